"""Words that every format shares, and how text is laid out and escaped."""
