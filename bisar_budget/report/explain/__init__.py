"""How a row comes to its status: equations with their numbers, and how they are set."""
