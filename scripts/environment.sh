# Sourced by the scripts of this folder: the checkout's own Python environment, .venv.
# shellcheck shell=bash
#
#   set_up run    kinfmu and what it needs to run and to draw
#   set_up dev    that, and the tools for tests and checks
#
# Both do nothing (in well under half a second) when the environment is there and pyproject.toml is as it was installed.

ROOT="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)"
VENV="$ROOT/.venv"

# Nothing of another environment that may be active leaks into this one.
unset VIRTUAL_ENV PYTHONPATH PYTHONHOME PIP_TARGET PIP_PREFIX
export PIP_USER=0 PIP_DISABLE_PIP_VERSION_CHECK=1

fail() {
    printf '%s\n' "kinfmu: $*" >&2
    exit 1
}

# Prints the first Python that is new enough and can make environments.
find_python() {
    local name found="" version
    for name in python3 python3.14 python3.13 python3.12 python3.11 python; do
        version="$("$name" -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null)" || continue
        if ! "$name" -c 'import sys; sys.exit(sys.version_info < (3, 11))'; then
            found="$found; $name is $version"
        elif ! "$name" -c 'import ensurepip, venv' 2>/dev/null; then
            found="$found; $name is $version without venv (Debian: apt-get install python$version-venv)"
        else
            echo "$name"
            return
        fi
    done
    fail "needs Python 3.11 or newer with venv and pip; looked for python3, python3.11 to python3.14${found:-; found none}"
}

# What .venv/installed says after an installation of $1 (run or dev).
installation() {
    printf '%s\n' "$ROOT" "$1"
    cat "$ROOT/pyproject.toml"
}

is_set_up() {
    local kind installed
    "$VENV/bin/python" -c '' 2>/dev/null || return 1
    installed="$(cat "$VENV/installed" 2>/dev/null)" || return 1
    for kind in "$1" dev; do # dev has all that run has
        if [[ "$installed" == "$(installation "$kind")" ]]; then return 0; fi
    done
    return 1
}

# No environment, a broken one, one left by an interruption, or one made when the checkout was elsewhere.
must_be_made() {
    local elsewhere="$ROOT"
    if [[ -e "$VENV/unfinished" ]] || ! "$VENV/bin/python" -c '' 2>/dev/null; then return 0; fi
    if [[ -e "$VENV/installed" ]]; then IFS= read -r elsewhere <"$VENV/installed"; fi
    [[ "$elsewhere" != "$ROOT" ]]
}

# A copy of kinfmu in .venv, not the checkout itself.
is_installed_by_hand() {
    local shown
    shown="$("$VENV/bin/python" -m pip show kinfmu 2>/dev/null)" || return 1
    [[ "$shown" == *"Name: kinfmu"* && "$shown" != *"Editable project location"* ]]
}

install() {
    local kind="$1" python what=".[figures,viewer]"
    if [[ "$kind" == dev ]]; then what=".[dev]"; fi
    if must_be_made; then
        python="$(find_python)"
        echo "kinfmu: making .venv with $("$python" --version)" >&2
        rm -rf "$VENV"
        mkdir "$VENV"
        touch "$VENV/unfinished" # until all is installed: pip takes a package that it was interrupted in for whole
        "$python" -m venv "$VENV"
    fi
    if [[ ! -e "$VENV/installed" ]] && is_installed_by_hand; then
        echo "kinfmu: .venv has kinfmu as pip installed it; this checkout itself, which later edits change, replaces it" >&2
    fi
    touch "$VENV/unfinished"
    rm -f "$VENV/installed"
    echo "kinfmu: installing into .venv" >&2
    # compat: a plain path, so that a script next to a checkout named kinfmu imports the package and not that folder.
    (cd "$ROOT" && "$VENV/bin/python" -m pip install --quiet --config-settings editable_mode=compat --editable "$what") ||
        fail "installing into .venv failed, see above"
    rm "$VENV/unfinished"
    installation "$kind" >"$VENV/installed"
}

set_up() {
    if is_set_up "$1"; then return; fi
    exec 9<"$ROOT" # where there is flock, a second script started meanwhile waits here
    if command -v flock >/dev/null; then flock 9; fi
    if ! is_set_up "$1"; then install "$1"; fi
    exec 9<&-
}

# Debian packages, installed as root or by sudo without a password; fails with a line that says why it cannot.
# $1: what else may be done where there is no apt-get.
debian_packages() {
    local otherwise="$1" as_root=()
    shift
    command -v apt-get >/dev/null || fail "no apt-get here; $otherwise (Debian calls it $*)"
    if dpkg --status "$@" 2>/dev/null | grep -c '^Status: install ok installed' | grep -qx "$#"; then return; fi
    if ((EUID != 0)); then
        sudo -n true 2>/dev/null || fail "neither root nor sudo without a password; ask for: apt-get install $*"
        as_root=(sudo -n)
    fi
    export DEBIAN_FRONTEND=noninteractive
    ${as_root[@]+"${as_root[@]}"} apt-get -qq update || fail "apt-get update failed, so $* are not installed"
    ${as_root[@]+"${as_root[@]}"} apt-get -qq install --yes --no-install-recommends "$@" >/dev/null ||
        fail "apt-get could not install $*"
}

# Prints the comment at the head of a script when it is asked for help.
help_if_asked() {
    if [[ "${1:-}" == --help || "${1:-}" == -h ]]; then
        sed -n '2,/^[^#]/s/^# \{0,1\}//p' "$0"
        exit 0
    fi
}

takes_no_arguments() {
    if (($# > 0)); then
        printf '%s\n' "kinfmu: scripts/$(basename "$0") takes no arguments, got '$*'" >&2
        exit 2
    fi
}
