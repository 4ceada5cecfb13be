#!/bin/sh
# Everything a developer or a visitor needs, from a bare Debian or Ubuntu on.
#
#   sh dev.sh demo [DIR]           set up, and make a relief of the built-in scene
#   sh dev.sh test [PYTEST...]     set up, and run the tests, without -m all but the slow ones
#   sh dev.sh lint                 set up, and run ruff and mypy
#   sh dev.sh bench NAME [ARG...]  set up, and run benchmarks/NAME.py
#   sh dev.sh setup                set up only
#
# PYTHON names the interpreter (3.10 to 3.13), VENV the virtual environment (default: .venv beside this file).
set -eu

root=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd)
venv=${VENV:-$root/.venv}

say() { printf '%s\n' "dev.sh: $*" >&2; }
die() { say "$*"; exit 2; }

usage() { sed -n '4,8s/^#  *//p' "$root/dev.sh"; }

fits() { "$1" -c 'import sys; sys.exit(not (3, 10) <= sys.version_info[:2] <= (3, 13))' 2>/dev/null; }

find_python() {
    for name in ${PYTHON:-python3 python3.13 python3.12 python3.11 python3.10}; do
        if command -v "$name" >/dev/null 2>&1 && fits "$name"; then
            printf '%s\n' "$name"
            return
        fi
    done
}

# Install the Debian packages that are missing: Open3D's libraries, and Python itself where it lacks venv.
system_packages() {
    command -v dpkg-query >/dev/null 2>&1 || return 0
    missing=
    wanted='libegl1 libgl1 libx11-6 libusb-1.0-0'
    found=$(find_python)
    if [ -z "$found" ]; then
        wanted="$wanted python3 python3-venv"
    elif ! "$found" -c 'import ensurepip, venv' 2>/dev/null; then
        # Debian's own python3 needs python3-venv, another version its own package.
        version=$("$found" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
        wanted="$wanted python$version-venv"
    fi
    for package in $wanted; do
        state=$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null || true)
        [ "$state" = installed ] || missing="$missing $package"
    done
    [ -n "$missing" ] || return 0

    line="apt-get update && apt-get install -y --no-install-recommends$missing"
    if [ "$(id -u)" = 0 ]; then
        as_root='env'
    elif command -v sudo >/dev/null 2>&1 && sudo -n true 2>/dev/null; then
        as_root='sudo -n env'
    else
        die "these Debian packages are missing:$missing. Type: sudo sh -c '$line'"
    fi
    say "installing the Debian packages that are missing:$missing"
    $as_root apt-get update -q >&2
    # shellcheck disable=SC2086
    $as_root DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends $missing >&2
}

setup() {
    stamp="$venv/.o3d-relief-$( (echo "$root"; cat "$root/pyproject.toml") | cksum | tr ' ' '-')"
    [ -f "$stamp" ] && [ -x "$venv/bin/python" ] && return 0
    system_packages
    python=$(find_python)
    [ -n "$python" ] || die "no Python 3.10 to 3.13 found; name one: PYTHON=/path/to/python3 sh dev.sh ..."
    say "making the virtual environment $venv with $("$python" --version) (about 2 GB, a few minutes)"
    "$python" -m venv "$venv" >&2
    "$venv/bin/python" -m pip install -q --disable-pip-version-check --upgrade pip >&2
    "$venv/bin/python" -m pip install -q --disable-pip-version-check -e "$root[dev]" >&2
    rm -f "$venv"/.o3d-relief-*
    : >"$stamp"
}

command=${1:-help}
[ $# -eq 0 ] || shift
case $command in
setup)
    setup
    ;;
demo)
    setup
    exec "$venv/bin/python" -m o3d_relief demo "$@"
    ;;
test)
    setup
    cd "$root"
    case " $* " in
    *" -m "*) ;;
    *) set -- "$@" -m 'not slow' ;;
    esac
    exec "$venv/bin/python" -m pytest "$@"
    ;;
lint)
    setup
    cd "$root"
    "$venv/bin/ruff" format --check .
    "$venv/bin/ruff" check .
    exec "$venv/bin/mypy"
    ;;
bench)
    setup
    [ $# -gt 0 ] || die "name a benchmark: $(cd "$root/benchmarks" && echo *.py)"
    name=${1%.py}
    shift
    [ -f "$root/benchmarks/$name.py" ] || die "there is no benchmarks/$name.py"
    exec "$venv/bin/python" "$root/benchmarks/$name.py" "$@"
    ;;
help | -h | --help)
    usage
    ;;
*)
    usage >&2
    die "unknown command: $command"
    ;;
esac
