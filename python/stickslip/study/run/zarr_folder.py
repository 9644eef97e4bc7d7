"""What a zarr folder says about itself, read before zarr does: format 2 knows filters that run code."""

from __future__ import annotations

import json
from pathlib import Path

from stickslip.faults import InputError

#: Codecs of zarr that read numbers and texts, and nothing else.
CODECS = ("bytes", "vlen-utf8", "transpose", "zstd", "gzip", "blosc", "crc32c")

#: Attribute that tells the store of a study, which other runs continue, from a dataset.
STORE = "study_store"


def is_store(folder: Path) -> bool:
    """Return whether a zarr folder is the store of a study."""
    record = json.loads((folder / "zarr.json").read_text(encoding="utf-8"))
    return bool(record.get("attributes", {}).get(STORE))


def check_zarr(folder: Path) -> None:
    """Refuse a folder that is not of format 3 alone, or has other codecs."""
    if not (folder / "zarr.json").is_file():
        raise InputError("expected a zarr folder of format 3, got one without zarr.json")
    for pattern in (".zgroup", ".zarray", ".zmetadata"):
        for file in (*folder.glob(pattern), *folder.glob(f"*/{pattern}")):
            where = file.relative_to(folder)
            raise InputError(f"expected a zarr folder of format 3 alone, got one with {where} of format 2")
    for file in (folder / "zarr.json", *folder.glob("*/zarr.json")):
        record = json.loads(file.read_text(encoding="utf-8"))
        where = file.relative_to(folder)
        if record["zarr_format"] != 3:
            raise InputError(f"{where}: zarr_format: expected 3, got {record['zarr_format']!r}")
        for codec in record.get("codecs", ()):
            name = codec if isinstance(codec, str) else codec["name"]
            if name not in CODECS:
                raise InputError(f"{where}: codecs: expected {', '.join(CODECS)}, got {name!r}")
