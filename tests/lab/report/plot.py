#!/usr/bin/python3
"""Draws one plot of a page: plot.py PLOT.json PLOT.svg

PLOT.json has the members of Chart or HeatMap as plot.h explains them, and `id`; a number that is
not finite is null. PLOT.svg is one <svg> element without a script, with names as tool tips. All
positions are in px from the left and the bottom of the picture.
"""
import io
import json
import logging
import math
import sys
import xml.etree.ElementTree as xml

try:
    import matplotlib
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LogNorm, Normalize
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch, Rectangle
    from matplotlib.textpath import TextPath
    from matplotlib.ticker import MaxNLocator
except ImportError:
    sys.exit("python3-matplotlib is not installed: apt-get install python3-matplotlib, then try again.")

# Okabe and Ito's colours, the darkest and most different first; without yellow, which is hardly
# visible on white. The page's style sheet (page_style.h) finds colours by these values.
SERIES_COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#555555", "#882255"]
INK = "#222222"      # text, and marks on top of others
SOFT = "#666666"     # axes and their numbers
GRID = "#e8e8e8"     # lines behind the data
PAPER = "#ffffff"
MISSING = "#d9d9d9"  # cells that were not measured
FONTS = ["Inter", "Segoe UI", "Helvetica", "Arial", "DejaVu Sans"]
FONT = 13.0

SVG = "{http://www.w3.org/2000/svg}"

LEFT, RIGHT, BOTTOM, TOP = 76.0, 22.0, 58.0, 16.0  # around the frame of a plot
KEY_SAMPLE = 46.0                                  # a mark in the key, with its distances
BAR = 96.0                                         # colours of a map and their numbers
KEY_ROW, TITLE = 22.0, 28.0
MARK = 6.0                                         # half the width of a mark, with some distance

# matplotlib's name of a mark, and its size.
MARKS = {"circle": ("o", 8.5), "square": ("s", 7.5), "triangle": ("^", 9.5), "diamond": ("D", 7.5),
         "down": ("v", 9.5), "pentagon": ("p", 10.0), "cross": ("x", 8.0), "ring": ("o", 13.0)}
IN_TURN = ["circle", "square", "triangle", "diamond", "down", "pentagon"]
# Width, dashes and the way from point to point.
LINES = {"straight": (1.8, "-", "default"), "dashed": (1.8, (0, (3.5, 2.2)), "default"),
         "stairs": (1.2, (0, (2.5, 2.5)), "steps-post")}
BORDER_DASHES = ["-", (0, (4, 2)), (0, (1, 1.5)), (0, (4, 1.5, 1, 1.5))]


def can_show(value, logarithmic):
    return value is not None and (not logarithmic or value > 0.0)


def span_of(axis, values, room=0.06):
    """The shown range of an axis: its own limits, else all values and a little room. From zero on
    if all values are above and near it: a chart of errors that starts at 0.11 exaggerates
    differences. Without any value there is a default."""
    logarithmic = axis["logarithmic"]
    shown = [value for value in values if can_show(value, logarithmic)] or [1.0]
    low, high = min(shown), max(shown)
    if logarithmic:
        more = max(high / low, 1.5) ** room * (1.0 if high > low else 1.2)
        low, high = low / more, high * more
    else:
        wide = high - low if high > low else max(abs(high), 1.0)
        low, high = 0.0 if 0.0 <= low < 2.0 * wide else low - room * wide, high + room * wide
    if can_show(axis["low"], logarithmic):
        low = axis["low"]
    if can_show(axis["high"], logarithmic):
        high = axis["high"]
    if not high > low:
        high = 2.0 * low if logarithmic else low + 1.0
    return low, high


def log_ticks(low, high):
    """Numbers at 1, 2 and 5 for a span of three decades or less, at the decades for a longer one."""
    digits = (1, 2, 5) if math.log10(high / low) <= 3.0 else (1,)
    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
    # Of very many decades only every second or third one has a number.
    every = max(1, (last - first + 3) // 7)
    ticks = [digit * 10.0 ** decade for decade in range(first, last + 1, every) for digit in digits]
    ticks = [tick for tick in ticks if 0.999 * low <= tick <= 1.001 * high]
    # A span without such a number still needs numbers at its ends.
    return [(tick, f"{tick:g}") for tick in ticks] or [(low, f"{low:.3g}"), (high, f"{high:.3g}")]


def placed_labels(tags, width_of, left, right, bottom, top):
    """Lower left corners of names beside their marks, as (index, x, y). tags: (x, y, name) of each
    mark; without a name it only takes space. A name stands at the first place right, left, above or
    below its mark that covers no mark and no name and is inside the four borders. A name without
    space is left out: it is still in the tool tip and the table. The first tags choose first."""
    taken = [(x - MARK, y - MARK, x + MARK, y + MARK) for x, y, _ in tags]
    placed = []
    for n, (x, y, name) in enumerate(tags):
        if not name:
            continue
        wide, high, away = width_of(name), FONT, MARK + 1.0
        # A little above the mark first: stairs and lines leave it to the right or downwards.
        for x0, y0 in [(x + away, y + away / 2), (x + away, y - high / 2), (x - wide / 2, y + away),
                       (x - away - wide, y - high / 2), (x - away - wide, y + away / 2),
                       (x - wide / 2, y - away - high), (x + away, y - away / 2 - high),
                       (x - away - wide, y - away / 2 - high)]:
            x1, y1 = x0 + wide, y0 + high
            inside = left <= x0 and x1 <= right and bottom <= y0 and y1 <= top
            if inside and not any(x0 < c and a < x1 and y0 < d and b < y1 for a, b, c, d in taken):
                taken.append((x0, y0, x1, y1))
                placed.append((n, x0, y0))
                break
    return placed


def edges_of(values, logarithmic):
    """Borders of the cells along an axis: half way between neighbours, one more than values."""
    at = [math.log(value) if logarithmic else value for value in values]
    inner = [0.5 * (a + b) for a, b in zip(at, at[1:])]
    first = 2.0 * at[0] - inner[0] if inner else at[0] - 0.5
    last = 2.0 * at[-1] - inner[-1] if inner else at[-1] + 0.5
    edges = [first, *inner, last]
    return [math.exp(edge) for edge in edges] if logarithmic else edges


def text_width(words):
    return TextPath((0.0, 0.0), words, size=FONT).get_extents().width if words.strip() else 0.0


def number(value):
    return f"{value:g}"


class Picture:
    """A figure in px, and the tool tips of the marks in it."""

    def __init__(self, width, height):
        self.width, self.height = width, height
        # At 72 dots per inch a point is one px.
        self.figure = Figure(figsize=(width / 72.0, height / 72.0), dpi=72, facecolor=PAPER)
        self.tips = {}  # by the id of a group: a text for each mark in it

    def axes(self, left, bottom, right, top):
        """Axes whose frame is at these four places."""
        axes = self.figure.add_axes((left / self.width, bottom / self.height, (right - left) / self.width,
                                     (top - bottom) / self.height), axisbelow=True)
        axes.spines[["top", "right"]].set_visible(False)
        axes.spines[["left", "bottom"]].set_color(SOFT)
        axes.tick_params(direction="in", length=3.0, pad=7.0, color=SOFT, labelcolor=SOFT)
        axes.minorticks_off()
        return axes

    def text(self, x, y, words, **look):
        self.figure.text(x / self.width, y / self.height, words, color=INK, **look)

    def key(self, samples, x, y):
        """Samples below each other, each with its label; x and y: the upper left corner."""
        self.figure.legend(handles=samples, loc="upper left", bbox_to_anchor=(x / self.width, y / self.height),
                           frameon=False, labelcolor=INK, borderpad=0.0, borderaxespad=0.0, handlelength=2.2,
                           labelspacing=KEY_ROW / FONT - 1.0)

    def tip(self, artist, texts):
        """Gives each mark of an artist its text."""
        artist.set_gid(f"tip{len(self.tips)}")
        self.tips[artist.get_gid()] = texts

    def write(self, path, title):
        """Writes the picture as an element of a page: without matplotlib's header and style sheet
        (which would be the whole page's), with tool tips, and with those ids only that the picture
        itself refers to; they are made from the plot's id."""
        text = io.StringIO()
        FigureCanvasSVG(self.figure).print_svg(text, metadata={"Date": None})
        svg = xml.fromstring(text.getvalue())
        svg.remove(svg.find(SVG + "metadata"))
        svg.remove(svg.find(f"{SVG}defs[{SVG}style]"))
        svg.set("style", "stroke-linejoin: round; stroke-linecap: butt")
        svg.set("role", "img")
        svg.set("width", str(self.width))
        svg.set("height", str(self.height))
        heading = xml.Element(SVG + "title")
        heading.text = title
        svg.insert(0, heading)
        for group in svg.iter(SVG + "g"):
            # A mark is a `use` where a shape is drawn many times, else the group's only path.
            tips = self.tips.get(group.attrib.pop("id", None), [])
            marks = group.findall(f".//{SVG}use") or group.findall(SVG + "path")
            for mark, tip in zip(marks, tips, strict=bool(tips)):
                xml.SubElement(mark, SVG + "title").text = tip
        with open(path, "w", encoding="utf-8") as file:
            file.write(xml.tostring(svg, encoding="unicode"))


def dress(which, axis, low, high):
    """Title, range and numbers of an axis; which: matplotlib's axis. Returns the range."""
    logarithmic = axis["logarithmic"]
    name = which.axis_name
    which.axes.set(**{f"{name}scale": "log" if logarithmic else "linear"})
    which.axes.set(**{f"{name}lim": (low, high)})
    which.set_label_text(axis["title"], color=INK)
    which.labelpad = 6.0
    which.set_tick_params(which="minor", length=0.0)
    ticks = axis["ticks"] or (log_ticks(low, high) if logarithmic else None)
    if ticks:
        which.set_ticks(*zip(*ticks))
        which.set_ticks([], minor=True)
    else:
        which.set_major_locator(MaxNLocator(8, steps=[1, 2, 5, 10]))


def draw_chart(chart):
    x_axis, y_axis = chart["x"], chart["y"]
    points = [point for series in chart["series"] for point in series["points"]]
    x_span = span_of(x_axis, [p["x"] for p in points] + [g["value"] for g in chart["guides"] if g["vertical"]])
    y_span = span_of(y_axis, [p["y"] for p in points] + [g["value"] for g in chart["guides"] if not g["vertical"]])

    # The frame, with the key to the right of it.
    picture = Picture(chart["width_px"], chart["height_px"])
    widest = max(text_width(series["name"]) for series in chart["series"])
    right = picture.width - RIGHT - (widest + KEY_SAMPLE + 14.0 if widest else 0.0)
    top = picture.height - TOP
    axes = picture.axes(LEFT, BOTTOM, right, top)
    dress(axes.xaxis, x_axis, *x_span)
    dress(axes.yaxis, y_axis, *y_span)
    axes.grid(color=GRID, linewidth=1.0)
    if chart["behind"]:
        grey = [math.nan if value is None else value for value in chart["behind"]["values"]]
        columns = chart["behind"]["columns"]
        rows = [grey[n:n + columns] for n in range(0, len(grey), columns)]
        axes.imshow(rows, cmap="gray", vmin=0.0, vmax=1.0, extent=chart["behind"]["edges"], origin="lower",
                    interpolation="nearest", zorder=0.7)
        # imshow changes the ranges. More is shown along one axis, so that both have one scale in this frame.
        axes.set(xlim=x_span, ylim=y_span)
        axes.set_aspect("equal", adjustable="datalim")
        axes.apply_aspect()

    # Guides, behind the data.
    for guide in chart["guides"]:
        if not can_show(guide["value"], (x_axis if guide["vertical"] else y_axis)["logarithmic"]):
            continue
        look = {"color": SOFT, "linewidth": 1.2, "linestyle": (0, (1.5, 2.5)), "zorder": 1.0}
        words = {"color": SOFT, "fontsize": 12.0, "textcoords": "offset points", "annotation_clip": False}
        if guide["vertical"]:
            axes.axvline(guide["value"], **look)
            axes.annotate(guide["name"], (guide["value"], 0.985), (5.0, 0.0), va="top",
                          xycoords=axes.get_xaxis_transform(), **words)
        else:
            axes.axhline(guide["value"], **look)
            axes.annotate(guide["name"], (0.995, guide["value"]), (0.0, 3.0), ha="right",
                          xycoords=axes.get_yaxis_transform(), **words)

    # Series: lines below marks.
    samples, tags, unnamed = [], [], []
    for n, series in enumerate(chart["series"]):
        shown = [p for p in series["points"]
                 if can_show(p["x"], x_axis["logarithmic"]) and can_show(p["y"], y_axis["logarithmic"])]
        if not shown:
            continue
        mark = series["mark"] or IN_TURN[n % len(IN_TURN)]
        over = mark in ("cross", "ring") and series["colour"] is None
        colour = INK if over else SERIES_COLOURS[(n if series["colour"] is None else series["colour"]) % 8]
        sample = None
        if series["line"] != "none":
            width, dashes, way = LINES[series["line"]]
            sample, = axes.plot([p["x"] for p in shown], [p["y"] for p in shown], color=colour, linewidth=width,
                                linestyle=dashes, drawstyle=way, zorder=2.0, label=series["name"])
        if mark != "none":
            within = [p for p in shown if x_span[0] <= p["x"] <= x_span[1] and y_span[0] <= p["y"] <= y_span[1]]
            shape, size = MARKS[mark]
            sample, = axes.plot([p["x"] for p in within], [p["y"] for p in within], linestyle="none", marker=shape,
                                markersize=size, color=colour, zorder=3.0, label=series["name"], clip_on=False,
                                markerfacecolor="none" if mark == "ring" else colour,
                                markeredgewidth=1.3 if mark in ("cross", "ring") else 0.0)
            picture.tip(sample, ["\n".join(filter(None, (p["name"], p["detail"]))) for p in within])
            for p in within:
                x, y = axes.transData.transform((p["x"], p["y"]))
                (tags if p["labelled"] else unnamed).append((x, y, p["name"] if p["labelled"] else ""))
        if series["name"]:
            samples.append(sample)

    if samples:
        picture.key(samples, right + 14.0, top)
    for n, x, y in placed_labels(tags + unnamed, text_width, LEFT + 2.0, right + 14.0, BOTTOM + 2.0, top):
        picture.text(x, y + 0.5 * FONT, tags[n][2], va="center_baseline", zorder=4.0)
    return picture


def on_any_colour(axes, x, y, width, dashes="-"):
    """A narrow dark line on a wide white one."""
    axes.plot(x, y, color=PAPER, linewidth=width + 2.2, zorder=2.0)
    axes.plot(x, y, color=INK, linewidth=width, linestyle=dashes, zorder=2.1)


def draw_mark(axes, mark, cells, edges):
    """Marks cells (x, y indices). Strokes are in fractions of a cell, so that all look alike."""
    strokes = {"hatch": [(0, 0.67, 0.33, 1), (0, 0.33, 0.67, 1), (0, 0, 1, 1), (0.33, 0, 1, 0.67), (0.67, 0, 1, 0.33)],
               "cross": [(0.25, 0.25, 0.75, 0.75), (0.25, 0.75, 0.75, 0.25)]}
    to_px, back = axes.transData.transform, axes.transData.inverted().transform
    for x, y in cells:
        low = to_px((edges[0][x], edges[1][y]))
        size = to_px((edges[0][x + 1], edges[1][y + 1])) - low
        if mark == "dot":
            at = back(low + 0.5 * size)
            axes.plot(*at, "o", markersize=5.5, color=PAPER, markeredgewidth=0.0, zorder=2.2)
            axes.plot(*at, "o", markersize=3.5, color=INK, markeredgewidth=0.0, zorder=2.3)
        for x0, y0, x1, y1 in strokes.get(mark, []):
            ends = back([low + size * (x0, y0), low + size * (x1, y1)])
            on_any_colour(axes, ends[:, 0], ends[:, 1], 1.0)


def draw_map(plot):
    x_axis, y_axis, bar = plot["x"], plot["y"], plot["bar"]
    edges = [edges_of(plot[f"{axis}_values"], plot[axis]["logarithmic"]) for axis in "xy"]
    colours = span_of(bar, [value for panel in plot["panels"] for value in panel["values"]], 0.0)
    norm = (LogNorm if bar["logarithmic"] else Normalize)(*colours, clip=True)
    viridis = matplotlib.colormaps["viridis"]

    # The key is above the panels and makes the picture higher, so that it hides no cell.
    samples = {}
    if any(value is None for panel in plot["panels"] for value in panel["values"]):
        samples["not measured"] = Patch(color=MISSING, linewidth=0.0)
    for marked in (marked for panel in plot["panels"] for marked in panel["marks"]):
        samples[marked["name"]] = (
            Patch(facecolor=PAPER, edgecolor=INK, linewidth=0.0, hatch="////") if marked["mark"] == "hatch" else
            Line2D([], [], linestyle="none", color=INK, marker="x" if marked["mark"] == "cross" else "o",
                   markersize=8.0 if marked["mark"] == "cross" else 5.0))
    for n, border in enumerate(plot["borders"]):
        samples[border["name"]] = Line2D([], [], color=INK, linewidth=2.0, linestyle=BORDER_DASHES[n % 4])
    samples.pop("", None)
    for name, sample in samples.items():
        sample.set_label(name)

    count, wide = len(plot["panels"]), min(len(plot["panels"]), 2)
    title = TITLE if any(panel["title"] for panel in plot["panels"]) else 0.0
    key = KEY_ROW * len(samples) + 8.0 if samples else 0.0
    picture = Picture(wide * plot["width_px"], key + math.ceil(count / 2) * (plot["height_px"] + title))
    if samples:
        picture.key(list(samples.values()), LEFT, picture.height - 4.0)

    for p, panel in enumerate(plot["panels"]):
        # Frame, title and axes.
        left = p % 2 * plot["width_px"] + LEFT
        right = left - LEFT + plot["width_px"] - RIGHT - BAR
        upper = picture.height - key - p // 2 * (plot["height_px"] + title)
        bottom, top = upper - title - plot["height_px"] + BOTTOM, upper - title - TOP
        if panel["title"]:
            picture.text(left, top + 10.0, panel["title"], fontsize=15.0, fontweight="semibold")
        axes = picture.axes(left, bottom, right, top)
        for which, axis, edge in ((axes.xaxis, x_axis, edges[0]), (axes.yaxis, y_axis, edges[1])):
            low, high = ((edge[end] if axis[name] is None else axis[name]) for end, name in ((0, "low"), (-1, "high")))
            dress(which, axis, low, high)

        # Cells, each with its numbers as a tool tip.
        cells = [(x, y) for y in range(len(plot["y_values"])) for x in range(len(plot["x_values"]))]
        for (x, y), value in zip(cells, panel["values"], strict=True):
            corner = edges[0][x], edges[1][y]
            cell = axes.add_patch(Rectangle(corner, edges[0][x + 1] - corner[0], edges[1][y + 1] - corner[1],
                                            linewidth=0.7,
                                            color=MISSING if value is None else viridis(norm(value))))
            named = [dict(axis["ticks"]).get(at, number(at))
                     for axis, at in ((x_axis, plot["x_values"][x]), (y_axis, plot["y_values"][y]))]
            picture.tip(cell, [f"{x_axis['title']}: {named[0]}\n{y_axis['title']}: {named[1]}\n{bar['title']}: "
                               + ("not measured" if value is None else f"{value:.4g}")])

        # Marks of cells, and borders.
        for marked in panel["marks"]:
            draw_mark(axes, marked["mark"], marked["cells"], edges)
        for n, border in enumerate(plot["borders"]):
            if border["points"]:
                on_any_colour(axes, *zip(*border["points"]), 2.0, BORDER_DASHES[n % 4])

        # Colours; with few steps, because each is an element of the picture.
        scale = picture.axes(right + 20.0, bottom, right + 34.0, top)
        colour_bar = picture.figure.colorbar(ScalarMappable(norm, viridis.resampled(64)), scale)
        colour_bar.solids.set_edgecolor("face")
        colour_bar.outline.set_visible(False)
        colour_bar.set_label(bar["title"], color=INK)
        if bar["logarithmic"]:
            at, numbers = zip(*log_ticks(*colours))
            colour_bar.set_ticks(at, labels=numbers)
        colour_bar.minorticks_off()
        scale.tick_params(length=0.0, labelcolor=SOFT)
    return picture


def main(plot_path, svg_path):
    with open(plot_path, encoding="utf-8") as file:
        plot = json.load(file)
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # of fonts that are not installed
    xml.register_namespace("", SVG[1:-1])
    xml.register_namespace("xlink", "http://www.w3.org/1999/xlink")
    # Text stays text, formulas are none, and ids are made from the plot's own.
    matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": plot["id"], "text.parse_math": False,
                                "font.family": FONTS, "font.size": FONT, "axes.labelsize": FONT,
                                "xtick.labelsize": FONT, "ytick.labelsize": FONT, "legend.fontsize": FONT})
    (draw_map if "panels" in plot else draw_chart)(plot).write(svg_path, plot["title"])


if __name__ == "__main__":
    main(*sys.argv[1:])
