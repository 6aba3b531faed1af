"""What a drawing shows: the lines, rectangles and texts of an SVG, by their style."""

import re
from xml.etree import ElementTree

SVG = "{http://www.w3.org/2000/svg}"
Point = tuple[float, float]


class Drawing:
    """Elements of an SVG document that `bisar_budget` drew; y runs down. [px]"""

    def __init__(self, document: str | bytes) -> None:
        self.root = ElementTree.fromstring(document)

    @property
    def texts(self) -> list[str]:
        """Everything that is written."""
        return ["".join(text.itertext()) for text in self.root.iter(f"{SVG}text")]

    def place(self, written: str) -> Point:
        """Where a text stands, the only one of its words."""
        (found,) = [text for text in self.root.iter(f"{SVG}text") if "".join(text.itertext()) == written]
        turned = re.findall(r"-?[\d.]+", found.get("transform", ""))
        x, y = turned[:2] or (found.get("x", ""), found.get("y", ""))
        return float(x), float(y)

    def paths(self, style: str) -> list[str]:
        """What the paths of a style are, in SVG's words."""
        return [path.get("d", "") for path in self.root.iter(f"{SVG}path") if path.get("class") == style]

    def lines(self, style: str) -> list[list[Point]]:
        """Points of each path of a style."""
        return [
            [(float(x), float(y)) for x, y in re.findall(r"([\d.-]+) ([\d.-]+)", path)] for path in self.paths(style)
        ]

    def line(self, style: str) -> list[Point]:
        """Points of the widest line of a style; those of a legend are short."""
        return max(self.lines(style), key=lambda line: max(x for x, _ in line) - min(x for x, _ in line))

    def boxes(self, style: str) -> list[tuple[float, float, float, float]]:
        """Rectangles of a style: left, top, right, bottom; that of a legend is the last one of a path of its own."""
        return [self.box(box) for box in self.paths(style)[0].split("Z")[:-1]]

    @staticmethod
    def box(path: str) -> tuple[float, float, float, float]:
        """Left, top, right and bottom of a rectangle."""
        left, top, right, bottom = (float(number) for number in re.findall(r"-?[\d.]+", path)[:4])
        return left, top, right, bottom

    def circles(self, style: str) -> list[Point]:
        """Middles of the circles of a style."""
        found = [one for one in self.root.iter(f"{SVG}circle") if one.get("class") == style]
        return [(float(one.get("cx", "")), float(one.get("cy", ""))) for one in found]

    def within(self, point: Point) -> Point:
        """A place as parts of the frame, from its left and from its bottom."""
        left, top, right, bottom = self.frame
        return (point[0] - left) / (right - left), (bottom - point[1]) / (bottom - top)

    @property
    def frame(self) -> tuple[float, float, float, float]:
        """Edges of the frame: left, top, right, bottom."""
        xs, ys = zip(*self.line("frame"), strict=True)
        return min(xs), min(ys), max(xs), max(ys)
