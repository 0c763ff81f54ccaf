"""The apt repository: apt itself, with folders of its own and without root, takes the packages and refuses changed ones.

usage: apt_repository_test.py SOURCE_DIR
"""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

SKIPPED = 77


def run(*command, **options):
    return subprocess.run(command, capture_output=True, text=True, **options)


def a_package(folder, version, architecture="amd64"):
    """A package that holds one file."""
    tree = folder / f"tree_{version}_{architecture}"
    (tree / "DEBIAN").mkdir(parents=True)
    (tree / "usr/share/palpate-tried").mkdir(parents=True)
    (tree / "usr/share/palpate-tried/version").write_text(version)
    name = "palpate-tried" + ("-data" if architecture == "all" else "")
    (tree / "DEBIAN/control").write_text(
        f"Package: {name}\nVersion: {version}\nArchitecture: {architecture}\n"
        "Maintainer: a test <a@test.example>\nDescription: a package of a test\n")
    package = folder / f"{name}_{version}_{architecture}.deb"
    assert run("dpkg-deb", "--build", "--root-owner-group", str(tree), str(package)).returncode == 0
    return package


class Apt:
    """apt with folders of its own."""

    def __init__(self, folder, repository, suite):
        self.folder = folder
        for name in ("lists/partial", "cache/archives/partial", "state"):
            (folder / name).mkdir(parents=True)
        (folder / "status").touch()
        (folder / "sources.list").write_text(
            f"deb [signed-by={repository}/palpate.gpg] file:{repository} {suite} main\n")

    def __call__(self, *words):
        options = {"Dir::Etc::sourcelist": "sources.list", "Dir::State": "state", "Dir::State::lists": "lists",
                   "Dir::State::status": "status", "Dir::Cache": "cache"}
        command = ["apt-get"]
        for key, value in options.items():
            command += ["-o", f"{key}={self.folder / value}"]
        command += ["-o", "Dir::Etc::sourceparts=-", "-o", "APT::Architecture=amd64", "-o", "Debug::NoLocking=true",
                    "-o", "APT::Sandbox::User=", "-o", "Acquire::Languages=none"]
        return run(*command, *words, cwd=self.folder)


def main(source):
    for tool in ("apt-get", "dpkg-deb", "dpkg-scanpackages", "gpg"):
        if not shutil.which(tool):
            print(f"SKIPPED: {tool} is missing.")
            return SKIPPED
    with tempfile.TemporaryDirectory() as place:
        folder = pathlib.Path(place)
        # gpg starts an agent whose socket has a short path; it ends with its folder.
        home = folder / "g"
        home.mkdir(mode=0o700)
        os.environ["GNUPGHOME"] = str(home)
        made = run("gpg", "--batch", "--passphrase", "", "--quick-gen-key", "tried@palpate.example", "ed25519", "sign")
        assert made.returncode == 0, made.stderr
        repository = folder / "repository"

        def make(suite, *packages, key="tried@palpate.example"):
            return run(sys.executable, f"{source}/cmake/apt_repository.py", str(repository), "--suite", suite, "--key", key,
                       *map(str, packages))

        first, data = a_package(folder, "1.0"), a_package(folder, "1.0", "all")
        done = make("bookworm", first, data)
        assert done.returncode == 0, done.stderr
        assert "2 packages for bookworm" in done.stdout

        # apt takes both, one of which is for every architecture.
        apt = Apt(folder / "apt", repository, "bookworm")
        updated = apt("update")
        assert updated.returncode == 0, updated.stderr
        assert not updated.stderr.strip(), updated.stderr
        fetched = apt("download", "palpate-tried", "palpate-tried-data")
        assert fetched.returncode == 0, fetched.stderr
        assert (folder / "apt" / first.name).read_bytes() == first.read_bytes()
        assert (folder / "apt" / data.name).exists()

        # Another suite is added; a new version takes the place of the old one, and the other suite stays.
        assert make("trixie", a_package(folder, "1.1")).returncode == 0
        assert make("bookworm", a_package(folder, "2.0")).returncode == 0
        assert apt("update").returncode == 0
        assert "palpate-tried_2.0" in apt("download", "--print-uris", "palpate-tried").stdout
        assert [path.name for path in (repository / "pool/trixie").iterdir()] == ["palpate-tried_1.1_amd64.deb"]
        assert not (repository / "pool/bookworm" / first.name).exists()

        # What was changed afterwards is refused: a list, and a package.
        packages = repository / "dists/bookworm/main/binary-amd64/Packages"
        packages.write_text(packages.read_text().replace("a package of a test", "another package"))
        packages.with_suffix(".gz").unlink()
        changed = Apt(folder / "apt_changed", repository, "bookworm")("update")
        assert changed.returncode != 0 and "Hash Sum mismatch" in changed.stderr, changed.stderr
        assert make("bookworm", folder / "palpate-tried_2.0_amd64.deb").returncode == 0
        with open(repository / "pool/bookworm/palpate-tried_2.0_amd64.deb", "r+b") as package:
            package.seek(200)
            package.write(b"changed")
        fresh = Apt(folder / "apt_fresh", repository, "bookworm")
        assert fresh("update").returncode == 0
        assert "Hash Sum mismatch" in fresh("download", "palpate-tried").stderr

        # Wrong input gets one sentence, and the repository stays as it was.
        before = packages.read_text()
        lacks = make("bookworm", first, key="nobody@palpate.example")
        assert lacks.returncode != 0 and lacks.stderr.count("\n") == 1, lacks.stderr
        assert "is no package" in make("bookworm", folder / "nothing.deb").stderr
        assert packages.read_text() == before
        assert not [path for path in repository.iterdir() if path.name.startswith(".")]
        run("gpgconf", "--kill", "gpg-agent")
    return 0


sys.exit(main(sys.argv[1]))
