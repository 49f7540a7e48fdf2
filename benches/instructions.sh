#!/usr/bin/env bash
# Instructions per frame, counted by valgrind: a measure of speed that other programs on the machine do not disturb.
#
#   benches/instructions.sh [WHAT]...
#
# Prints `what,instructions` as CSV, for the kinds of frame named or for all of them. Each is rendered by `specula bench` at 640x360
# from four views, on one thread and with AVX2, which valgrind knows and AVX-512 it does not. One turn and three turns are
# counted: starting up, loading and warming up take the same in both, so the difference is that of eight frames. Counts
# repeat within a tenth of a percent: what remains is bookkeeping of times, and how they are printed. Takes about a minute.
set -euo pipefail
cd "$(dirname "$0")/.."

if ! command -v valgrind > /dev/null; then
    echo "instructions.sh: needs valgrind, which is not installed (Debian: apt install valgrind)" >&2
    exit 1
fi

declare -A arguments=(
    [gouraud]="scenes/teapot.ron --method gouraud"
    [phong]="scenes/teapot.ron --method phong"
    [adaptive]="scenes/teapot.ron --method adaptive --work 500000"
    [fine_gouraud]="scenes/heavy.ron --method gouraud"
)
views=4
few=1
many=3

program=${CARGO_TARGET_DIR:-target}/release/specula
log=$(mktemp)
trap 'rm -f "$log"' EXIT

# Instructions of a whole run: count ARGUMENTS TURNS
count() {
    # Arguments are separate words.
    # shellcheck disable=SC2086
    if ! valgrind --tool=callgrind --callgrind-out-file=/dev/null "$program" bench $1 --views "$views" --repeat "$2" \
        --size 640x360 --threads 1 --simd avx2 --error 0 > "$log" 2>&1; then
        cat "$log" >&2
        exit 1
    fi
    sed -n 's/.*Collected : \([0-9]*\).*/\1/p' "$log"
}

if [ $# -eq 0 ]; then
    set -- gouraud phong adaptive fine_gouraud
fi
for what in "$@"; do
    if [ -z "${arguments[$what]:-}" ]; then
        echo "instructions.sh: no '$what' to count, only: ${!arguments[*]}" >&2
        exit 2
    fi
done
cargo build --release --quiet
echo "what,instructions"
for what in "$@"; do
    less=$(count "${arguments[$what]}" "$few")
    more=$(count "${arguments[$what]}" "$many")
    echo "$what,$(((more - less) / (views * (many - few))))"
done
