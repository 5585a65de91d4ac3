"""Holds the Python of the README, the pages and the examples against dForce's types, as a user's own checker would.

``python docs/_ext/typed_blocks.py`` runs mypy without any plugin or setting of this project.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[2]
BLOCK = re.compile(r"^```(?:\{ran\} )?python\n(?P<code>.*?)^```$", re.MULTILINE | re.DOTALL)


def main() -> int:
    """Check everything, and return mypy's result."""
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
    with tempfile.TemporaryDirectory(prefix="dforce-typed-") as folder:
        for page in pages:
            code = "\n".join(match["code"] for match in BLOCK.finditer(page.read_text(encoding="utf-8")))
            if code:
                name = re.sub(r"\W", "_", page.stem.lower())
                Path(folder, f"{name}.py").write_text(re.sub(r"^:.*\n", "", code, flags=re.MULTILINE), encoding="utf-8")
        examples = [str(path) for path in sorted((ROOT / "examples").glob("*/*.py"))]
        command = [sys.executable, "-m", "mypy", "--config-file=", "--cache-dir", str(ROOT / ".mypy_cache" / "blocks")]
        more = ["--ignore-missing-imports", "--scripts-are-modules", "--no-namespace-packages"]
        return subprocess.run([*command, *more, folder, *examples], check=False, cwd=ROOT).returncode


if __name__ == "__main__":
    sys.exit(main())
