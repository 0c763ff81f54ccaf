#!/usr/bin/env python3
"""Makes a signed apt repository as static files, of packages that cpack has made: for a web server, or for file://.

    cpack --config build/CPackConfig.cmake -B packages
    cmake/apt_repository.py repository --suite bookworm --key founders@palpate.example packages/*.deb

Called again with another suite it adds that one; a suite is made anew from the packages named. The packages of a suite are
made on that Debian, since they name its libraries. The private key is one of gpg's; its public part is written beside, as
palpate.gpg. On another machine, as root:

    cp repository/palpate.gpg /usr/share/keyrings/
    echo "deb [signed-by=/usr/share/keyrings/palpate.gpg] file:/PATH/repository bookworm main" > /etc/apt/sources.list.d/palpate.list
    apt-get update && apt-get install palpate

Needs dpkg-scanpackages (dpkg-dev) and gpg.
"""

import argparse
import email.utils
import gzip
import hashlib
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile


def output_of(*command, **options):
    """What the command prints; ends the program with its last sentence where it fails."""
    try:
        return subprocess.run(command, check=True, capture_output=True, **options).stdout
    except FileNotFoundError:
        sys.exit(f"apt_repository.py: {command[0]} is missing: install dpkg-dev and gpg.")
    except subprocess.CalledProcessError as failure:
        said = failure.stderr.decode(errors="replace").strip().splitlines()
        sys.exit(f"apt_repository.py: {command[0]}: {said[-1] if said else 'it failed and said nothing'}")


def index(repository, suite, folder):
    """Writes Packages and Packages.gz of the packages in `folder`; returns the architectures."""
    packages = output_of("dpkg-scanpackages", "--multiversion", str(folder.relative_to(repository)), cwd=repository)
    of_suite = repository / "dists" / suite / "main"
    known = {line[14:] for line in packages.decode().splitlines() if line.startswith("Architecture: ")}
    # A list for each architecture holds what is for all of them, too.
    for architecture in sorted(known - {"all"}) or ["amd64"]:
        place = of_suite / f"binary-{architecture}"
        place.mkdir(parents=True)
        stanzas = packages.decode().strip().split("\n\n")
        chosen = [one for one in stanzas
                  if f"\nArchitecture: {architecture}\n" in one or "\nArchitecture: all\n" in one]
        text = ("\n\n".join(chosen) + "\n").encode()
        (place / "Packages").write_bytes(text)
        # The time of packing is no part of it: the same packages give the same files.
        (place / "Packages.gz").write_bytes(gzip.compress(text, mtime=0))
    return sorted(known - {"all"}) or ["amd64"]


def sign(repository, suite, architectures, key):
    """Writes Release with the sums of all lists, and InRelease, which is the same with a signature."""
    of_suite = repository / "dists" / suite
    sums = []
    for path in sorted(of_suite.rglob("Packages*")):
        data = path.read_bytes()
        sums.append(f" {hashlib.sha256(data).hexdigest()} {len(data)} {path.relative_to(of_suite)}")
    release = "\n".join(["Origin: palpate", "Label: palpate", f"Suite: {suite}", f"Codename: {suite}",
                         f"Date: {email.utils.formatdate(usegmt=True).replace('GMT', 'UTC')}",
                         f"Architectures: {' '.join(architectures)}", "Components: main",
                         "Description: feel, see and follow moving volumes", "SHA256:"] + sums) + "\n"
    (of_suite / "Release").write_text(release, encoding="utf-8")
    gpg = ("gpg", "--batch", "--yes", "--local-user", key)
    output_of(*gpg, "--clearsign", "--output", str(of_suite / "InRelease"), str(of_suite / "Release"))
    public = output_of("gpg", "--batch", "--export", key)
    if not public:
        sys.exit(f"apt_repository.py: gpg has no key '{key}': 'gpg --list-secret-keys' shows them.")
    (repository / "palpate.gpg").write_bytes(public)


def main():
    parser = argparse.ArgumentParser(description="Makes a signed apt repository as static files.")
    parser.add_argument("repository", type=pathlib.Path, help="folder, made where it is missing")
    parser.add_argument("packages", nargs="+", type=pathlib.Path, metavar="DEB")
    parser.add_argument("--suite", required=True, help="the Debian that the packages are for, such as bookworm")
    parser.add_argument("--key", required=True, help="gpg's name of the private key that signs")
    asked = parser.parse_args()
    for package in asked.packages:
        if not package.is_file() or package.suffix != ".deb":
            sys.exit(f"apt_repository.py: '{package}' is no package (.deb).")
    repository = asked.repository.resolve()
    repository.mkdir(parents=True, exist_ok=True)
    # Built beside and renamed, so that a failure leaves the former suite as it was.
    with tempfile.TemporaryDirectory(dir=repository, prefix=".making-") as making:
        made = pathlib.Path(making)
        pool = made / "pool" / asked.suite
        pool.mkdir(parents=True)
        for package in asked.packages:
            shutil.copy2(package, pool)
        sign(made, asked.suite, index(made, asked.suite, pool), asked.key)
        for part in (pathlib.Path("pool") / asked.suite, pathlib.Path("dists") / asked.suite):
            (repository / part).parent.mkdir(parents=True, exist_ok=True)
            shutil.rmtree(repository / part, ignore_errors=True)
            os.rename(made / part, repository / part)
        os.replace(made / "palpate.gpg", repository / "palpate.gpg")
    print(f"Wrote {asked.repository}: {len(asked.packages)} packages for {asked.suite}")


main()
