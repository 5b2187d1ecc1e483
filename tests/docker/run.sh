#!/usr/bin/env bash
# Build the image and run the compose file for real.   tests/docker/run.sh [PYTEST ARGUMENTS]
#
# Starts Docker where it does not run (as root) and leaves nothing behind. $BASE: an image to build on; without
# it one is made from Debian's packages. $PYTHON: one with linkwind[test].
set -euo pipefail
cd "$(dirname "$0")/../.."
work=$(mktemp -d)
pid=
forward="--policy FORWARD ACCEPT"

stop() {
    if [ -n "$pid" ]; then
        kill "$pid" 2>/dev/null && wait "$pid" || true
        iptables $forward || true # Docker forbids forwarding, for everybody
        ip link delete docker0 2>/dev/null || true
    else
        docker image rm --force linkwind-under-test linkwind-base >/dev/null 2>&1 || true
    fi
    rm -rf "$work"
}
trap stop EXIT

if ! docker info >/dev/null 2>&1; then
    forward=$(iptables --list-rules FORWARD | head -n 1) || true
    dockerd --data-root "$work/docker" --pidfile "$work/pid" >"$work/log" 2>&1 &
    pid=$!
    for _ in $(seq 120); do
        docker info >/dev/null 2>&1 && break
        if ! kill -0 "$pid" 2>/dev/null; then
            pid=
            echo "docker: skipped: dockerd does not start here: $(tail -n 1 "$work/log")"
            exit 0
        fi
        sleep 0.5
    done
fi

if [ -z "${BASE:-}" ]; then
    export BASE=linkwind-base
    tests/docker/base.sh "$BASE"
fi
LINKWIND_TEST_DOCKER=1 "${PYTHON:-python3}" -m pytest -n 0 -q --durations=3 tests/docker "$@"
LINKWIND_IMAGE=linkwind-under-test "${PYTHON:-python3}" -m tests.faults 10 container
docker image ls linkwind-under-test
