#!/usr/bin/env python3
"""Prints the licences of all crates that are compiled into the programs of a workspace, each text once.

`packaging/licences.py MANIFEST`. deny.toml says which licences there may be, and `cargo deny check licenses` holds the
crates to it; this collects the texts that the crates carry.
"""

import json
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

TARGETS = ("x86_64-unknown-linux-gnu", "aarch64-unknown-linux-gnu")
NAMES = ("licen", "copying", "notice", "copyright", "unlicense")


def compiled_in(manifest: Path) -> list[dict]:
    """The packages of others that a program of the workspace is made of: no build scripts, no tests."""
    packages, needed = {}, set()
    for target in TARGETS:
        told = subprocess.run(
            ["cargo", "metadata", "--locked", "--format-version=1", "--filter-platform", target]
            + ["--manifest-path", manifest],
            check=True,
            stdout=subprocess.PIPE,
        )
        metadata = json.loads(told.stdout)
        packages |= {package["id"]: package for package in metadata["packages"]}
        nodes = {node["id"]: node for node in metadata["resolve"]["nodes"]}
        # What the tests alone want is no part of a program.
        members = {name for name in metadata["workspace_members"] if packages[name]["name"] not in ("system-tests", "test-run")}
        to_visit, visited = list(members), set()
        while to_visit:
            name = to_visit.pop()
            if name in visited:
                continue
            visited.add(name)
            for dependency in nodes[name]["deps"]:
                if any(kind["kind"] is None for kind in dependency["dep_kinds"]):
                    to_visit.append(dependency["pkg"])
        needed |= visited
    others = [packages[name] for name in needed if packages[name]["source"] is not None]
    return sorted(others, key=lambda package: (package["name"], package["version"]))


def texts(package: dict) -> list[str]:
    """The texts of licences and notices that a package carries."""
    folder = Path(package["manifest_path"]).parent
    files = {path for path in folder.iterdir() if path.is_file() and path.name.lower().startswith(NAMES)}
    files |= {path for path in folder.glob("LICENSES/*") if path.is_file()}
    if package["license_file"]:
        files.add(folder / package["license_file"])
    return [path.read_text(errors="replace").strip() for path in sorted(files)]


def main() -> None:
    packages = compiled_in(Path(sys.argv[1]))
    users = defaultdict(list)
    print("Licences of the Rust crates that these programs are made of.\n")
    for package in packages:
        name = f"{package['name']} {package['version']}"
        carried = texts(package)
        origin = package["repository"] or "https://crates.io/crates/" + package["name"]
        remark = "" if carried else "; carries no text, the ones below are meant"
        print(f"{name}: {package['license'] or 'see its text'}{remark}\n    {origin}")
        for text in carried:
            users[text].append(name)
    for text, names in sorted(users.items(), key=lambda item: item[1]):
        print("\n" + "-" * 78)
        print("Of " + ", ".join(names) + ":\n")
        print(text)


main()
