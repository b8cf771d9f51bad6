"""Drawings as SVG: shapes and text in pixels, x to the right and y down."""
import math
from xml.sax.saxutils import escape

from .colours import BLACK

FONT = "Helvetica, Arial, 'Liberation Sans', sans-serif"
# Diagonal lines, light and dense: what they fill is told apart in grey too.
PATTERNS = {"hatched": (8, "#909090"), "dense": (4, "#d55e00")}


def number(value):
    """A length, to a tenth of a pixel."""
    return f"{value:.1f}".rstrip("0").rstrip(".")


class Drawing:
    """Collects shapes, the first lowest. Fills and strokes are colours, or "hatched" or "dense" for a fill."""

    def __init__(self, width, height):
        self.width, self.height, self.parts = width, height, []

    def shape(self, name, content="", fill="none", stroke=BLACK, line=1.2, dash="", **attributes):
        if fill in PATTERNS:
            fill = f"url(#{fill})"
        style = f' fill="{fill}"'
        if stroke != "none":
            style += f' stroke="{stroke}" stroke-width="{number(line)}"' + (f' stroke-dasharray="{dash}"' if dash else "")
        values = "".join(f' {key}="{number(value) if isinstance(value, (int, float)) else value}"' for key, value in attributes.items())
        self.parts.append(f"<{name}{values}{style}" + (f">{content}</{name}>" if content else "/>"))

    def box(self, x, y, width, height, round_by=0, **style):
        self.shape("rect", x=x, y=y, width=width, height=height, **({"rx": round_by} if round_by else {}), **style)

    def polygon(self, points, **style):
        self.shape("polygon", points=" ".join(f"{number(x)},{number(y)}" for x, y in points), **style)

    def path(self, points, **style):
        self.shape("polyline", points=" ".join(f"{number(x)},{number(y)}" for x, y in points), **style)

    def segment(self, a, b, **style):
        self.path([a, b], **style)

    def circle(self, centre, radius, **style):
        self.shape("circle", cx=centre[0], cy=centre[1], r=radius, **style)

    def arrow(self, a, b, stroke=BLACK, line=1.4, both=False, **style):
        """A line from a to b with a head at b, or at both ends."""
        length = math.dist(a, b)
        u = ((b[0] - a[0]) / length, (b[1] - a[1]) / length)
        head = 8
        start = (a[0] + head * u[0], a[1] + head * u[1]) if both else a
        self.segment(start, (b[0] - head * u[0], b[1] - head * u[1]), stroke=stroke, line=line, **style)
        for tip, along in ((b, 1), (a, -1))[:1 + both]:
            back = (tip[0] - along * (head + 1) * u[0], tip[1] - along * (head + 1) * u[1])
            self.polygon([tip, (back[0] - 3.6 * u[1], back[1] + 3.6 * u[0]), (back[0] + 3.6 * u[1], back[1] - 3.6 * u[0])], fill=stroke, stroke="none")

    def text(self, x, y, text, size=13, anchor="start", colour=BLACK, bold=False, italic=False, halo="none"):
        """Lines of text; y is the foot of the first. The halo is the colour of a rim, which keeps lines behind the text away from it."""
        for i, line in enumerate(text.split("\n")):
            style = {"font-weight": "bold"} if bold else {}
            style |= {"font-style": "italic"} if italic else {}
            style |= {"text-anchor": anchor} if anchor != "start" else {}
            style |= {"paint-order": "stroke"} if halo != "none" else {}
            self.shape("text", escape(line), fill=colour, stroke=halo, line=3.5, x=x, y=y + i * (size + 4), **{"font-size": size}, **style)

    def save(self, path):
        patterns = "".join(f'<pattern id="{name}" width="{step}" height="{step}" patternUnits="userSpaceOnUse" patternTransform="rotate(45)">'
                           f'<path d="M0 0V{step}" stroke="{colour}" stroke-width="2"/></pattern>'
                           for name, (step, colour) in PATTERNS.items() if any(f"url(#{name})" in part for part in self.parts))
        head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{self.width}" height="{self.height}" viewBox="0 0 {self.width} {self.height}" font-family="{FONT}">'
        lines = [head, *([f"<defs>{patterns}</defs>"] if patterns else []), '<rect width="100%" height="100%" fill="#ffffff"/>', *self.parts, "</svg>"]
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
