"""Start an example with the words of the command line; it is no example itself."""

import inspect
import sys
from collections.abc import Callable
from typing import Any

import o3d_relief as rel


def start(main: Callable[..., Any], explanation: str, words: list[str]) -> None:
    """Call `main`; where that is not possible, say why in one sentence and end with 2."""
    if {"-h", "--help"} & set(words):
        print(explanation.strip())
        return
    try:
        inspect.signature(main).bind(*words)
    except TypeError as error:
        sys.exit(_told(f"{error}, see --help"))
    try:
        main(*words)
    except rel.ReliefError as error:
        sys.exit(_told(str(error)))


def _told(sentence: str) -> int:
    print(f"{sys.argv[0]}: error: {sentence}", file=sys.stderr)
    return 2
