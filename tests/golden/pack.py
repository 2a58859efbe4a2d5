#!/usr/bin/env python3
"""Writes golden files as they are shipped: FROM/{net,raster}/*.npz to TO/{net,raster}/*.npz.xz. Needs NumPy.

    pack.py FROM TO

The members of a file are stored and compressed together, so that their headers cost nothing, numbers aligned, so that
xz sees which byte of a number is which. Two things are left out:

* o.NAME, a network's output in float32, beside o64.NAME
* bits of the renderer's results below 2^-40 of the largest of their tensor (4.5e-13 of it; tests ask for 1e-11)

NumPy reads them: numpy.load(lzma.open(PATH)).
"""

import io
import lzma
import pathlib
import sys
import zipfile

import numpy as np

FILTERS = [{"lp": lp, "lc": lc, "pb": pb} for lp, lc, pb in ((2, 0, 2), (3, 0, 3), (3, 1, 3), (0, 3, 2))]


def rounded(values):
    if values.dtype != np.float64 or values.size == 0 or not np.isfinite(values).all() or not values.any():
        return values
    step = 2.0 ** (np.ceil(np.log2(np.abs(values).max())) - 40)
    return np.round(values / step) * step


def stored(arrays):
    """A .npz whose arrays begin at multiples of 64 bytes."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        for name, values in sorted(arrays.items(), key=lambda pair: (pair[1].dtype.itemsize, pair[0])):
            member = zipfile.ZipInfo(name + ".npy")
            begin = file.tell() + 30 + len(member.filename) + 4
            member.extra = b"\0\0" + (-begin % 64).to_bytes(2, "little") + bytes(-begin % 64)
            npy = io.BytesIO()
            np.save(npy, values)
            archive.writestr(member, npy.getvalue())
    return file.getvalue()


def packed(path):
    with np.load(path) as file:
        arrays = dict(file)
    arrays = {name: values for name, values in arrays.items()
              if not (name.startswith("o.") and "o64." + name[2:] in arrays)}
    if path.parent.name == "raster":
        arrays = {name: rounded(values) if "/" in name else values for name, values in arrays.items()}
    data = stored(arrays)
    return min((lzma.compress(data, filters=[{"id": lzma.FILTER_LZMA2, "preset": 9 | lzma.PRESET_EXTREME} | one])
                for one in FILTERS), key=len)


def main(source, target):
    for path in sorted(source.glob("*/*.npz")):
        out = target / path.parent.name / (path.name + ".xz")
        out.parent.mkdir(parents=True, exist_ok=True)
        out.write_bytes(packed(path))
        print(f"{path.stat().st_size:>9} {out.stat().st_size:>9} {out}")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*map(pathlib.Path, sys.argv[1:]))
