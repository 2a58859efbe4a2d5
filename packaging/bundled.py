"""What packages of a release bundle of other projects, as a document of SPDX 2.3."""
import hashlib
import re
import subprocess
import tarfile
import zipfile
from datetime import datetime, timezone
from pathlib import Path
from typing import Any, Dict, List

from notices import ROOT, projects

# Packages of this system that stand for what libsplat links: their version and licence are those of what is bundled.
# The headers compiled in, by their names in THIRD-PARTY.md.
HEADERS = {"JSON for Modern C++": "nlohmann-json3-dev", "volk": "libvulkan-volk-dev", "GLM": "libglm-dev",
           "CLI11": "libcli11-dev"}
# splat.dll and vkrun.exe have these inside, built by tools/windows/libraries from the same source packages, and the
# compiler's own libraries.
WINDOWS = {"giflib": "libgif7", "libjpeg-turbo": "libjpeg62-turbo", "libpng": "libpng16-16", "libwebp": "libwebp7",
           "libyaml": "libyaml-0-2", "zlib": "zlib1g", "zstd": "libzstd1", "gcc runtime": "libstdc++6",
           "mingw-w64": "mingw-w64-common"}
# What packages are called in SPDX's words.
LICENCES = {"libgif7": "MIT", "libjpeg62-turbo": "IJG AND BSD-3-Clause AND Zlib", "libpng16-16": "libpng-2.0",
            "libwebp7": "BSD-3-Clause", "libwebpmux3": "BSD-3-Clause", "libsharpyuv0": "BSD-3-Clause",
            "libyaml-0-2": "MIT", "zlib1g": "Zlib", "libzstd1": "BSD-3-Clause",
            "libstdc++6": "GPL-3.0-or-later WITH GCC-exception-3.1", "mingw-w64-common": "ZPL-2.1"}
LIBRARY = re.compile(r"(^|/)(lib(?!splat)[^/]*\.so[^/]*|(?!lib)(?!splat)[^/]*\.dll)$", re.IGNORECASE)


def debian_version(package: str) -> str:
    """The version of a package of this system."""
    command = ["dpkg-query", "-W", "-f", "${Version}", package]
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout or "unknown"


def owner(library: str) -> str:
    """The package of this system that has a library, by the file's name without a hash in it."""
    plain = re.sub(r"-[0-9a-f]{8,}(?=[.-])", "", Path(library).name)
    done = subprocess.run(["dpkg-query", "-S", f"*/{plain}"], capture_output=True, text=True, check=False)
    return done.stdout.split(":")[0] or plain


def files_of(package: Path) -> List[str]:
    """The names of files in a package; of a .deb none, since those of Debian bundle no libraries."""
    if package.suffix in (".whl", ".nupkg", ".zip"):
        with zipfile.ZipFile(package) as archive:
            return archive.namelist()
    if package.name.endswith((".tar.gz", ".tar.xz", ".crate")):
        with tarfile.open(package) as tar:
            return tar.getnames()
    return []


def parts_of(package: Path, files: List[str]) -> List[str]:
    """Which programs of ours a package has, as THIRD-PARTY.md names them."""
    if package.suffix == ".deb":
        return [part for part in ("libsplat", "vkrun") if re.match(rf"{part}[0-9._]", package.name)]
    return [part for part, file in (("libsplat", r"(^|/)(libsplat\.so|splat\.dll$)"), ("vkrun", r"/vkrun(\.exe)?$"))
            if any(re.search(file, name) for name in files)]


def element(name: str, version: str, licence: str, holder: str, url: str) -> Dict[str, Any]:
    """A package in SPDX's words."""
    return {"SPDXID": "SPDXRef-" + re.sub(r"[^A-Za-z0-9.-]", "-", name), "name": name, "versionInfo": version,
            "downloadLocation": url, "filesAnalyzed": False, "licenseConcluded": licence,
            "licenseDeclared": licence, "copyrightText": holder}


def bundled_in(package: Path) -> List[Dict[str, Any]]:
    """What is compiled into a package, and which libraries lie in it."""
    files = files_of(package)
    parts = parts_of(package, files)
    found = [element(row.name, debian_version(HEADERS[row.name]), row.licence, row.copyright, row.url)
             for row in projects((ROOT / "THIRD-PARTY.md").read_text("utf-8")) if set(parts) & set(row.parts)]
    owners = {owner(name) for name in files if LIBRARY.search(name)}
    if any(name.endswith("splat.dll") for name in files):
        owners |= set(WINDOWS.values())
    return found + [element(name, debian_version(name), LICENCES.get(name, "NOASSERTION"), "NOASSERTION", "NOASSERTION")
                    for name in sorted(owners)]


def spdx(packages: List[Path], version: str, date: int) -> Dict[str, Any]:
    """The document about files of a release."""
    elements: Dict[str, Dict[str, Any]] = {}
    relations = []
    digests = [hashlib.sha256(package.read_bytes()).hexdigest() for package in packages]
    for package, digest in zip(packages, digests):
        own = element(package.name, version, "MIT", "the libsplat authors", "NOASSERTION")
        own["packageFileName"] = package.name
        own["checksums"] = [{"algorithm": "SHA256", "checksumValue": digest}]
        elements[own["SPDXID"]] = own
        relations.append(("SPDXRef-DOCUMENT", "DESCRIBES", own["SPDXID"]))
        for part in bundled_in(package):
            elements[part["SPDXID"]] = part
            relations.append((own["SPDXID"], "CONTAINS", part["SPDXID"]))
    every = hashlib.sha256("".join(digests).encode()).hexdigest()
    return {"spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT",
            "name": f"libsplat-{version}", "documentNamespace": f"urn:sha256:{every}",
            "creationInfo": {"created": datetime.fromtimestamp(date, timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ"),
                             "creators": ["Tool: libsplat-release"]},
            "packages": list(elements.values()),
            "relationships": [{"spdxElementId": a, "relationshipType": kind, "relatedSpdxElement": b}
                              for a, kind, b in relations]}
