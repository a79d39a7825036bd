"""Makes the Blender extension with all wheels that it needs: python packaging/blender_zip.py.

Blender unpacks the wheels that its manifest names: then clpt runs in Blender's Python without a
network. Without one here, the .zip has the wheels of former runs (build/blender_wheels), and a line
says what is missing.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import zipfile
from importlib import metadata
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
WHEELS = ROOT / "build" / "blender_wheels"
PYTHON = "3.11"  # of Blender 4.5 and 5.0
BROUGHT = ("numpy",)  # by Blender itself
TAGS = {
    "linux-x64": [f"manylinux_2_{minor}_x86_64" for minor in (28, 27, 17, 12, 5)]
    + ["manylinux2014_x86_64"],
    "windows-x64": ["win_amd64"],
    "macos-arm64": [f"macosx_{major}_0_arm64" for major in (14, 13, 12, 11)],
    "macos-x64": [f"macosx_{version}_x86_64" for version in ("11_0", "10_15", "10_13", "10_9")],
}
# that packages ask for on other systems: pip asks which system it runs on, not which is wanted
FURTHER = {"windows-x64": ["colorama"]}


def pip(*words: str) -> bool:
    """Run pip; return whether it succeeded."""
    command = [sys.executable, "-m", "pip", "--disable-pip-version-check", *words, "--quiet"]
    return subprocess.run(command, check=False).returncode == 0


def wheels(platform: str, extras: str = "") -> tuple[list[Path], list[str]]:
    """Return the wheels for a platform, and the names of packages that are missing."""
    folder = WHEELS / platform
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob("clpt-*.whl"):
        old.unlink()
    built = pip("wheel", "--no-deps", "--wheel-dir", str(folder), str(ROOT))
    tags = [word for tag in TAGS[platform] for word in ("--platform", tag)]
    where = ["--dest", str(folder), "--find-links", str(folder), "--only-binary", ":all:"]
    own = [f"{file}{extras}" for file in folder.glob("clpt-*.whl")] + FURTHER.get(platform, [])
    loaded = built and pip("download", *own, *where, *tags, "--python-version", PYTHON)
    found = {plain(file.name.split("-")[0]): file for file in sorted(folder.glob("*.whl"))}
    missing = [] if loaded else [name for name in needed() if name not in found]
    left_out = BROUGHT if extras else (*BROUGHT, "pyoidn")
    return [file for name, file in found.items() if name not in left_out], missing


def needed() -> list[str]:
    """Return the names of all packages that clpt itself asks for."""
    names = [word.split(">=")[0] for word in metadata.requires("clpt") or () if "extra" not in word]
    return [name for name in map(plain, ["clpt", *names]) if name not in BROUGHT]


def plain(name: str) -> str:
    """Return the name of a package as all its spellings have it."""
    return name.replace("_", "-").lower()


def write(out: Path, platforms: list[str], extras: str = "") -> list[str]:
    """Write the extension; return the names of packages that are missing.

    extras: of clpt, in brackets.
    """
    manifest = (ROOT / "blender" / "blender_manifest.toml").read_text("utf-8")
    files: dict[str, Path] = {}
    missing: list[str] = []
    for platform in platforms:
        there, lacks = wheels(platform, extras)
        files |= {f"wheels/{file.name}": file for file in there}
        missing += [name for name in lacks if name not in missing]
    listed = "".join(f'  "./{name}",\n' for name in sorted(files))
    head, permissions = manifest.split("[permissions]")
    shown = ", ".join(f'"{platform}"' for platform in platforms)
    if files:
        head += f"platforms = [{shown}]\nwheels = [\n{listed}]\n\n"
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in [*sorted((ROOT / "blender").glob("*.py")), ROOT / "blender" / "LICENSE"]:
            archive.write(file, file.name)
        archive.writestr("blender_manifest.toml", f"{head}[permissions]{permissions}")
        for name, file in files.items():
            archive.write(file, name, zipfile.ZIP_STORED)
    return missing


def main() -> None:
    """Write the .zip, and say what it lacks."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--platform", action="append", choices=TAGS, help="by default linux-x64")
    parser.add_argument("--denoise", action="store_true", help="with Open Image Denoise, 88 MB")
    parser.add_argument("--out", type=Path, default=ROOT / "clpt_blender.zip")
    given = parser.parse_args()
    missing = write(given.out, given.platform or ["linux-x64"], "[denoise]" * given.denoise)
    print(f"{given.out}: {given.out.stat().st_size / 1e6:.1f} MB")
    if missing:
        print(
            f"it lacks {', '.join(missing)}: name a Python that has clpt in Blender's preferences"
        )


if __name__ == "__main__":
    main()
