"""Whether a window can be opened, found out before Open3D is asked: it would wait unseen for ever."""

from __future__ import annotations

import ctypes
import ctypes.util
import os
import socket
import sys
from pathlib import Path

from o3d_relief.errors import DisplayError

__all__ = ["require_display", "require_vulkan"]

_OTHER_WAY = "o3d-relief make INPUT OUTPUT --stages DIR draws every stage without one"


def require_display() -> None:
    """Check that there is a display to open a window on.

    On macOS and Windows every user has one. Elsewhere it is an X server that `DISPLAY` names or a Wayland
    compositor that `WAYLAND_DISPLAY` names, and it must answer.

    Raises
    ------
    DisplayError
        There is none.
    """
    if sys.platform in ("darwin", "win32"):
        return
    names = {name: os.environ.get(name, "") for name in ("WAYLAND_DISPLAY", "DISPLAY")}
    if names["WAYLAND_DISPLAY"] and _wayland_answers(names["WAYLAND_DISPLAY"]):
        return
    if names["DISPLAY"] and _x_answers():
        return
    named = [f"{name}={value}" for name, value in names.items() if value]
    what = f"the display {' and '.join(named)} does not answer" if named else "there is no display"
    raise DisplayError(f"No window can be opened, {what}: {_OTHER_WAY}.")


def require_vulkan() -> None:
    """Check that there is a Vulkan driver, which Open3D's gui draws with on Linux: it aborts without one.

    Raises
    ------
    DisplayError
        There is none.
    """
    if sys.platform in ("darwin", "win32"):
        return
    if not _vulkan_starts():
        raise DisplayError(
            "The editor's window needs a Vulkan driver: install that of the graphics card or, to draw "
            "without one, Debian's libvulkan1 and chromium-common with "
            "VK_ICD_FILENAMES=/usr/lib/chromium/vk_swiftshader_icd.json."
        )


def _vulkan_starts() -> bool:
    try:
        vulkan = ctypes.CDLL("libvulkan.so.1")
    except OSError:
        return False
    # VkInstanceCreateInfo: its type, 1, and nothing else.
    wanted = (ctypes.c_uint64 * 8)(1, 0, 0, 0, 0, 0, 0, 0)
    instance = ctypes.c_void_p()
    if vulkan.vkCreateInstance(ctypes.byref(wanted), None, ctypes.byref(instance)) != 0:
        return False
    count = ctypes.c_uint32()
    vulkan.vkEnumeratePhysicalDevices.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p]
    found = vulkan.vkEnumeratePhysicalDevices(instance, ctypes.byref(count), None)
    vulkan.vkDestroyInstance.argtypes = [ctypes.c_void_p, ctypes.c_void_p]
    vulkan.vkDestroyInstance(instance, None)
    return bool(found == 0 and count.value > 0)


def _x_answers() -> bool:
    library = ctypes.util.find_library("X11") or "libX11.so.6"
    try:
        x11 = ctypes.CDLL(library)
    except OSError:
        return False
    x11.XOpenDisplay.restype = ctypes.c_void_p
    x11.XOpenDisplay.argtypes = [ctypes.c_char_p]
    x11.XCloseDisplay.argtypes = [ctypes.c_void_p]
    display = x11.XOpenDisplay(None)
    if not display:
        return False
    x11.XCloseDisplay(display)
    return True


def _wayland_answers(name: str) -> bool:
    place = Path(os.environ.get("XDG_RUNTIME_DIR", "/nonexistent")) / name  # an absolute name stands alone
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
        connection.settimeout(2.0)
        try:
            connection.connect(str(place))
        except OSError:
            return False
    return True
