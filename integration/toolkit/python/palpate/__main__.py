"""python -m palpate: the program. In a wheel it is beside this file, otherwise the one on PATH."""

import ctypes
import os
import sys

# The libraries of a window, which the program needs to start. A system without them gets those of the wheel.
_WINDOW = ("libGL.so.1", "libX11.so.6", "libXext.so.6", "libXrender.so.1", "libxcb-shm.so.0", "libxcb-render.so.0")


def _is_there(library):
    try:
        ctypes.CDLL(library)
        return True
    except OSError:
        return False


def main():
    """Replaces this process by the program, with the same arguments. Exits with a sentence where there is none."""
    folder = os.path.dirname(os.path.abspath(__file__))
    program = os.path.join(folder, "bin", "palpate")
    try:
        if not os.path.exists(program):
            os.execvp("palpate", ["palpate", *sys.argv[1:]])
        if not _is_there("libvulkan.so.1"):
            sys.exit("palpate needs the Vulkan loader, libvulkan.so.1, and a Vulkan driver: install them (Debian, Ubuntu: apt install libvulkan1 "
                     "mesa-vulkan-drivers).")
        if not all(map(_is_there, _WINDOW)):
            others = os.environ.get("LD_LIBRARY_PATH")
            os.environ["LD_LIBRARY_PATH"] = os.path.join(folder, "lib", "window") + (":" + others if others else "")
        os.execv(program, [program, *sys.argv[1:]])
    except OSError as error:
        sys.exit(f"The program palpate can not be started ({error.strerror}): install the package palpate, or put its folder on PATH.")


if __name__ == "__main__":
    main()
