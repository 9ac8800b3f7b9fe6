"""Build the extension: one zip for each platform, by Blender's own builder, validated by it.

    python tools/build_extension.py [--platform NAME ...] [--python 3.11 3.13] [--output DIR]

Fetches SciPy's and embreex's wheels with pip into wheels/ (unmodified; kept between runs), lays
out a clean copy of what people install, and runs Blender's ``extension build`` and ``validate``
on it. The builder is the one of the Blender named by RADIOSITY_BLENDER, or of the module bpy.
"""

from __future__ import annotations

import argparse
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
WHEELS = ROOT / "wheels"
MANIFEST = "blender_manifest.toml"
REQUIREMENTS = ("scipy==1.16.3", "embreex==4.4.0.post1")
PYTHONS = ("3.11", "3.13")  # Blender's own, up to 5.0 and from 5.1
# What pip may choose from, newest first: the oldest systems that Blender itself supports.
PIP_PLATFORMS = {
    "linux-x64": ("manylinux_2_28_x86_64", "manylinux_2_27_x86_64", "manylinux2014_x86_64"),
    "windows-x64": ("win_amd64",),
    "macos-arm64": ("macosx_13_0_arm64", "macosx_12_0_arm64"),
}
INSTALLED = ("__init__.py", "radiosity_addon", "LICENSE", "README.md", "CHANGELOG.md")


def main(argv: list[str] | None = None) -> int:
    """Fetch, lay out, build, validate; print the zips. Returns the exit status."""
    asked = _arguments(argv)
    listed = tomllib.loads((ROOT / MANIFEST).read_text())["wheels"]
    wheels = fetch_wheels(asked.platform, asked.python)
    usual = asked.platform == list(PIP_PLATFORMS) and tuple(asked.python) == PYTHONS
    if usual and sorted(wheels) != sorted(Path(path).name for path in listed):
        print(f"{MANIFEST} must list these wheels:\n{wheel_list(wheels)}", file=sys.stderr)
        return 1
    asked.output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="radiosity-build-") as folder:
        source = Path(folder) / "radiosity"
        lay_out(source, wheels, asked.platform)
        blender("validate", source)
        blender("build", "--split-platforms", "--source-dir", source, "--output-dir", asked.output)
    for path in sorted(asked.output.glob("*.zip")):
        blender("validate", path)
        print(f"{path}  {path.stat().st_size / 2**20:.0f} MB")
    return 0


def fetch_wheels(platforms: list[str], pythons: list[str]) -> list[str]:
    """Download what is missing into wheels/; return the names of the wheels asked for."""
    names = []
    for platform in platforms:
        for python in pythons:
            tag = "cp" + python.replace(".", "")
            for requirement in REQUIREMENTS:
                names.append(_find(requirement, tag, platform) or _fetch(requirement, tag, platform))
    return sorted(names)


def _find(requirement: str, tag: str, platform: str) -> str | None:
    start = requirement.replace("==", "-") + f"-{tag}-{tag}-"
    systems = PIP_PLATFORMS[platform]
    found = [path.name for path in WHEELS.glob(f"{start}*.whl")]
    return next((name for name in found if any(system in name for system in systems)), None)


def _fetch(requirement: str, tag: str, platform: str) -> str:
    systems = [word for system in PIP_PLATFORMS[platform] for word in ("--platform", system)]
    line = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--dest", str(WHEELS)]
    line += ["--only-binary=:all:", "--python-version", tag[2:], *systems, requirement]
    subprocess.run(line, check=True)
    name = _find(requirement, tag, platform)
    if name is None:
        raise FileNotFoundError(f"pip brought no wheel of {requirement} for {platform} {tag}")
    return name


def lay_out(folder: Path, wheels: list[str], platforms: list[str]) -> None:
    """Copy what people install into ``folder``, with a manifest of these wheels."""
    folder.mkdir(parents=True)
    junk = shutil.ignore_patterns("__pycache__", "*.pyc", ".*")
    for name in INSTALLED:
        source = ROOT / name
        if source.is_dir():
            shutil.copytree(source, folder / name, ignore=junk)
        else:
            shutil.copy2(source, folder / name)
    (folder / "wheels").mkdir()
    for name in wheels:
        shutil.copy2(WHEELS / name, folder / "wheels" / name)
    text = (ROOT / MANIFEST).read_text()
    text = re.sub(r"^wheels = \[.*?^\]", lambda _: wheel_list(wheels), text, flags=re.S | re.M)
    quoted = ", ".join(f'"{name}"' for name in platforms)
    text = re.sub(r"^platforms = .*$", f"platforms = [{quoted}]", text, flags=re.M)
    (folder / MANIFEST).write_text(text)


def wheel_list(wheels: list[str]) -> str:
    """The manifest's ``wheels = [...]``."""
    return "wheels = [\n" + "".join(f'  "./wheels/{name}",\n' for name in sorted(wheels)) + "]"


def blender(*words) -> None:
    """Run Blender's ``extension`` command with these words. Raises CalledProcessError."""
    subprocess.run([*_builder(), *map(str, words)], check=True, stdout=subprocess.DEVNULL)


def _builder() -> list[str]:
    if "RADIOSITY_BLENDER" in os.environ:
        return [*shlex.split(os.environ["RADIOSITY_BLENDER"]), "--command", "extension"]
    line = [sys.executable, "-c", "import bpy; print(bpy.utils.system_resource('SCRIPTS'))"]
    found = subprocess.run(line, capture_output=True, text=True)
    if found.returncode:
        raise SystemExit("no builder: install the module bpy, or set RADIOSITY_BLENDER=blender")
    scripts = Path(found.stdout.strip().splitlines()[-1])
    return [sys.executable, str(scripts / "addons_core" / "bl_pkg" / "cli" / "blender_ext.py")]


def _arguments(argv: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    platforms = list(PIP_PLATFORMS)
    parser.add_argument("--platform", nargs="+", choices=platforms, default=platforms)
    parser.add_argument("--python", nargs="+", metavar="X.Y", default=list(PYTHONS))
    parser.add_argument("--output", type=Path, default=ROOT / "dist")
    return parser.parse_args(argv)


if __name__ == "__main__":
    sys.exit(main())
