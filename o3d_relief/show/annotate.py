"""What is written on a picture: points, a title, a legend, a colour bar."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image, ImageDraw, ImageFont

from o3d_relief.show.colors import apply_colormap

__all__ = ["Bar", "annotate", "draw_points", "font_size", "free_area", "tick_texts", "write"]

Bar = tuple[str, tuple[float, float], str]  # colour map, range, caption
Legend = Sequence[tuple[ArrayLike, str]]

INK = (48, 46, 44)
HALO = (222, 222, 221)


def font_size(size: tuple[int, int]) -> int:
    """Return the height of the letters for a picture of this size, in pixels."""
    return max(9, round(0.026 * float(np.sqrt(size[0] * size[1]))))


def _font(pixels: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(pixels)


def free_area(
    size: tuple[int, int], *, title: str, legend: Legend, bar: Bar | None
) -> tuple[float, float, float, float]:
    """Return what the writing leaves free: left, top, right and bottom in pixels."""
    letter = font_size(size)
    top = 2.0 * letter if title else 0.0
    bottom = (
        size[1] - (1.0 + 1.5 * len(_legend_rows(size, legend))) * letter if len(legend) else float(size[1])
    )
    right = float(size[0]) - 5.6 * letter if bar else float(size[0])
    return 0.0, min(top, 0.4 * size[1]), max(right, 0.4 * size[0]), max(bottom, 0.6 * size[1])


def annotate(image: NDArray[np.uint8], *, title: str, legend: Legend, bar: Bar | None) -> NDArray[np.uint8]:
    """Write a title at the top, a legend at the bottom and a colour bar on the right of a copy."""
    if not title and not len(legend) and bar is None:
        return image
    size = (image.shape[1], image.shape[0])
    picture = Image.fromarray(image)
    draw = ImageDraw.Draw(picture)
    letter = font_size(size)
    if title:
        place, font = (0.8 * letter, 0.6 * letter), _font(round(1.15 * letter))
        draw.text(place, title, fill=INK, font=font, stroke_width=2, stroke_fill=HALO)
    rows = _legend_rows(size, legend)
    for number, row in enumerate(rows):
        y = size[1] - (0.5 + 1.5 * (len(rows) - number)) * letter
        x = 0.8 * letter
        for color, text in row:
            draw.rectangle((x, y, x + letter, y + letter), fill=_bytes(color), outline=INK)
            draw.text((x + 1.4 * letter, y + 0.5 * letter), text, fill=INK, font=_font(letter), anchor="lm")
            x += _entry_width(letter, text)
    if bar is not None:
        _draw_bar(picture, draw, size, bar)
    return np.array(picture)


def write(
    image: NDArray[np.uint8], text: str, *, anchor: str, x: float, y: float, pixels: int
) -> NDArray[np.uint8]:
    """Write text on a copy; `anchor` is Pillow's ("lm": left and middle of the text lie at x, y)."""
    picture = Image.fromarray(image)
    ImageDraw.Draw(picture).text((x, y), text, fill=INK, font=_font(pixels), anchor=anchor)
    return np.array(picture)


def _bytes(color: ArrayLike) -> tuple[int, int, int]:
    red, green, blue = np.rint(np.clip(np.asarray(color, dtype=np.float64), 0.0, 1.0) * 255.0).astype(int)
    return int(red), int(green), int(blue)


def _entry_width(letter: int, text: str) -> float:
    return 2.6 * letter + float(_font(letter).getlength(text))


def _legend_rows(size: tuple[int, int], legend: Legend) -> list[list[tuple[ArrayLike, str]]]:
    """Break the entries into rows that fit the picture."""
    letter = font_size(size)
    rows: list[list[tuple[ArrayLike, str]]] = []
    used = np.inf
    for entry in legend:
        width = _entry_width(letter, entry[1])
        if used + width > size[0] - letter:
            rows.append([])
            used = 0.0
        rows[-1].append(entry)
        used += width
    return rows


def _draw_bar(picture: Image.Image, draw: ImageDraw.ImageDraw, size: tuple[int, int], bar: Bar) -> None:
    colormap, (low, high), caption = bar
    letter = font_size(size)
    left, right = size[0] - 5.0 * letter, size[0] - 4.0 * letter
    top, bottom = 0.22 * size[1], 0.78 * size[1]
    rows = max(2, round(bottom - top))
    colors = apply_colormap(np.linspace(1.0, 0.0, rows), colormap, (0.0, 1.0))
    strip = np.repeat(np.rint(colors * 255.0).astype(np.uint8)[:, None], round(right - left), axis=1)
    picture.paste(Image.fromarray(strip), (round(left), round(top)))
    x, y = round(left), round(top)
    draw.rectangle((x - 1, y - 1, x + strip.shape[1], y + rows), outline=INK)
    for part, text in zip(np.linspace(0.0, 1.0, 5), tick_texts(low, high), strict=True):
        y = top + (1.0 - part) * rows
        draw.line((right, y, right + 0.3 * letter, y), fill=INK)
        draw.text((right + 0.5 * letter, y), text, fill=INK, font=_font(round(0.9 * letter)), anchor="lm")
    half = 0.5 * float(_font(letter).getlength(caption))
    middle = min(0.5 * (left + right), size[0] - 0.6 * letter - half)
    draw.text((middle, top - 1.2 * letter), caption, fill=INK, font=_font(letter), anchor="mm")


def tick_texts(low: float, high: float) -> list[str]:
    """Return the numbers beside a colour bar, at its ends and quarters.

    They have as few digits as place them right to a fortieth of the bar.

    Examples
    --------
    >>> tick_texts(0.0, 1.0)
    ['0.00', '0.25', '0.50', '0.75', '1.00']
    >>> tick_texts(0.0, 22.1)
    ['0', '6', '11', '17', '22']
    """
    width = high - low
    values = np.linspace(low, high, 5)
    digits = 1 - int(np.floor(np.log10(width))) if width > 0.0 else 3
    if not -4 <= digits <= 5:
        return [f"{value:.2g}" for value in values]
    digits = max(digits, 0)
    if np.abs(np.round(values, digits) - values).max() > 0.025 * width:
        digits += 1
    texts = [f"{value:.{digits}f}" for value in values]
    return [text.replace("-", "", 1) if float(text) == 0.0 else text for text in texts]


def draw_points(
    image: NDArray[np.uint8], spots: NDArray[np.float64], colors: NDArray[np.float64], radius: float
) -> NDArray[np.uint8]:
    """Draw round points with a dark rim on a copy, the near ones over the far ones.

    Parameters
    ----------
    image : (height, width, 3) uint8
    spots : (p, 3) float64
        x, y in pixels and nearness.
    colors : (p, 3) float64
        sRGB in [0, 1].
    radius : float
        In pixels, without the rim.
    """
    height, width = image.shape[:2]
    result = image.astype(np.float64)
    rim = max(1.0, 0.3 * radius)
    reach = int(np.ceil(radius + rim + 1.0))
    for number in np.argsort(spots[:, 2], kind="stable"):
        x, y = spots[number, :2]
        if not (-reach <= x <= width + reach and -reach <= y <= height + reach):
            continue
        rows = slice(max(0, int(y) - reach), min(height, int(y) + reach + 1))
        columns = slice(max(0, int(x) - reach), min(width, int(x) + reach + 1))
        far = np.hypot(
            np.arange(rows.start, rows.stop)[:, None] + 0.5 - y,
            np.arange(columns.start, columns.stop) + 0.5 - x,
        )
        outer = np.clip(radius + rim + 0.5 - far, 0.0, 1.0)[..., None]
        inner = np.clip(radius + 0.5 - far, 0.0, 1.0)[..., None]
        patch = result[rows, columns] * (1.0 - 0.85 * outer) + 0.85 * outer * np.array(INK)
        result[rows, columns] = patch * (1.0 - inner) + inner * 255.0 * np.clip(colors[number], 0.0, 1.0)
    return np.asarray(np.rint(result), dtype=np.uint8)
