"""The package for Unity and NuGet is complete, and works with nothing but its own files; the pages' C# compiles.

usage: package_test.py SOURCE BUILD CMAKE MCS MONO
"""

import json
import os
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from pathlib import Path

source, build, cmake, mcs, mono = map(Path, sys.argv[1:])
SMALLEST = """
using Palpate;
static class Program
{
    static void Main()
    {
        using (var context = new PalContext(new PalContextInfo { Flags = PalContextFlags.NoGpu })) System.Console.WriteLine(PalInfo.Version);
    }
    static bool running = true;
    static void Show(PalVector place, PalVector force, string why) { }
%s}
"""
# The lines of a page, with what they leave out.
METHOD = """
    static void Run%d(PalVector grip_m, long now_ns, PalSession session)
    {
        %s
    }
"""


def run(*command, **more):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, **more)
    assert done.returncode == 0, f"{command}: {done.stdout}{done.stderr}"
    return done.stdout


with tempfile.TemporaryDirectory() as folder:
    out = Path(folder)
    run(cmake, "--install", build, "--component", "palpate_dotnet", "--prefix", out)
    # The list of what was installed is for uninstalling, and this is gone soon.
    (build / "install_manifest_palpate_dotnet.txt").unlink(missing_ok=True)
    package = out / "share/palpate/dotnet"

    # Unity ignores what has no .meta file; two of the same number are one asset.
    assets = [path for path in package.rglob("*") if path.suffix != ".meta" and "Samples~" not in path.parts and path.suffix != ".nuspec"]
    assert len(assets) == 11, assets
    numbers = set()
    for asset in assets:
        meta = Path(f"{asset}.meta").read_text()
        numbers.add(re.search(r"^guid: ([0-9a-f]{32})$", meta, re.M)[1])
        assert ("folderAsset: yes" in meta) == asset.is_dir(), asset
        if asset.suffix == ".so":
            assert f"isPreloaded: {int('unity' in asset.name)}\n" in meta, meta
    assert len(numbers) == len(assets), numbers
    assert len(list(package.rglob("*.meta"))) == len(assets), "a .meta file of nothing"
    version = re.search(r"project\(palpate VERSION (\S+)", (source / "CMakeLists.txt").read_text())[1]
    described = json.loads((package / "package.json").read_text())
    assert described["version"] == version
    for sample in described["samples"]:
        assert list((package / sample["path"]).glob("*.cs")), sample
    assert json.loads((package / "Runtime/Palpate.asmdef").read_text())["name"] == "Palpate"
    name = "{http://schemas.microsoft.com/packaging/2013/05/nuspec.xsd}"
    nuspec = ElementTree.parse(package / "palpate.nuspec")
    assert nuspec.find(f".//{name}version").text == version
    for file in nuspec.findall(f".//{name}file"):
        # Those for Windows come from another build.
        assert list(package.glob(file.get("src"))) or "Windows" in file.get("src"), file.get("src")

    # The lines of the pages, one method each, beside that program.
    methods = ""
    for page in (source / "docs/using/hosts.md", source / "integration/toolkit/dotnet/README.md"):
        for lines in re.findall(r"```csharp\n(.*?)```", page.read_text(), re.S):
            # The session of the last line is not the one that the lines before have opened.
            lines = lines.replace("var session", "var felt").replace("session.GetState", "felt.GetState")
            methods += METHOD % (methods.count("static void Run"), lines)
    assert methods.count("static void Run") == 2, methods
    (out / "program.cs").write_text(SMALLEST % methods)
    # A program with the package's source and library alone.
    plugins = package / "Runtime/Plugins/Linux/x86_64"
    assert (plugins / "libpalpate.so").stat().st_size < 20e6, "it is not stripped"
    run(mcs, "-langversion:7.2", "-r:System.Core.dll", f"-out:{out}/program.exe", out / "program.cs", *package.glob("Runtime/*.cs"))
    said = run(mono, out / "program.exe", env={**os.environ, "LD_LIBRARY_PATH": str(plugins)})
    major, minor, patch = map(int, version.split("."))
    assert int(said) == major << 16 | minor << 8 | patch, said
