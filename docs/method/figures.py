"""Makes the figures of docs/method from the files that `penombre render` wrote.

    pip install OpenEXR numpy pillow
    python3 figures.py layer IMAGE.exr LAYER OUT.png [SCALE [OTHER.exr]]
    python3 figures.py beside OUT.png COLUMNS A.png B.png ...

`layer`: LAYER is D, S, kd, ks or Le, shown times SCALE, then clipped and encoded as sRGB; or `level`, blue 0 to red 8, with black
lines where face or level change. Of OTHER.exr the same layer is taken off first: D of all light less D of direct light is
indirect D. `beside`: pictures of one size in rows of COLUMNS.
"""

import sys

import numpy as np
import OpenEXR
from PIL import Image

GAP = 4  # pixels between pictures that stand beside each other


def channels_of(path, names):
    channels = OpenEXR.File(path, separate_channels=True).channels()
    return np.stack([channels[name].pixels.astype(np.float64) for name in names], axis=-1)


def colours_of_levels(path):
    level, face = np.moveaxis(channels_of(path, ["level", "face.id"]), -1, 0)
    t = np.clip(level / 8, 0, 1)
    rgb = np.stack([t, 1 - np.abs(2 * t - 1), 1 - t], axis=-1) * 0.75 + 0.25
    edges = np.zeros(level.shape, bool)
    for values in (level, face):
        edges[:, 1:] |= values[:, 1:] != values[:, :-1]
        edges[1:] |= values[1:] != values[:-1]
    return np.where(edges[..., None], 0.0, np.where(face[..., None] == 0, 1.0, rgb))


def colours_of_layer(path, name, scale, other):
    names = [f"{name}.{channel}" for channel in "RGB"]
    values = channels_of(path, names) - (channels_of(other, names) if other else 0)
    c = np.clip(values * scale, 0, 1)
    return np.where(c <= 0.0031308, 12.92 * c, 1.055 * c ** (1 / 2.4) - 0.055)


def layer(path, name, out, scale="1", other=None):
    picture = colours_of_levels(path) if name == "level" else colours_of_layer(path, name, float(scale), other)
    Image.fromarray((picture * 255 + 0.5).astype(np.uint8)).save(out, optimize=True)


def beside(out, columns, *paths):
    pictures = [np.asarray(Image.open(path).convert("RGB")) for path in paths]
    (height, width, _), columns = pictures[0].shape, int(columns)
    rows = -(-len(pictures) // columns)
    sheet = np.full((rows * (height + GAP) - GAP, columns * (width + GAP) - GAP, 3), 255, np.uint8)
    for i, picture in enumerate(pictures):
        top, left = i // columns * (height + GAP), i % columns * (width + GAP)
        sheet[top : top + height, left : left + width] = picture
    Image.fromarray(sheet).save(out, optimize=True)


{"layer": layer, "beside": beside}[sys.argv[1]](*sys.argv[2:])
