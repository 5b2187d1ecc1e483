#!/usr/bin/env bash
# Make an image that the Dockerfile can build on where none can be pulled: Debian with Python, and pip set up
# as it is on this machine (index, timeout, CA bundle).   tests/docker/base.sh IMAGE
set -euo pipefail
image=$1
root=$(mktemp -d)
trap 'rm -rf "$root" "$root.log"' EXIT

debootstrap --variant=minbase --include=python3,python3-pip,python3-venv,ca-certificates bookworm "$root" >"$root.log" \
    || { tail -20 "$root.log" >&2; exit 1; }
rm -rf "$root"/var/cache/apt/archives/*.deb "$root"/var/lib/apt/lists/*

bundle=/etc/ssl/certs/ca-certificates.crt
for given in "${PIP_CERT:-}" "${REQUESTS_CA_BUNDLE:-}" "${SSL_CERT_FILE:-}" $bundle; do
    if [ -f "$given" ]; then cp -L "$given" "$root$bundle"; break; fi
done
"${PYTHON:-python3}" - "$bundle" >"$root/etc/pip.conf" <<'PY'
import ast, os, subprocess, sys

settings = {"cert": sys.argv[1]}
listed = subprocess.run([sys.executable, "-m", "pip", "config", "list"], capture_output=True, text=True, check=True)
for line in listed.stdout.splitlines():  # what the environment says comes first, and holds
    key, _, value = line.partition("=")
    remote = [word for word in ast.literal_eval(value).split() if not word.startswith(("/", "file:"))]
    if remote:  # a folder of this machine is not there
        settings.setdefault(key.rpartition(".")[2], " ".join(remote))
if proxy := os.environ.get("HTTPS_PROXY") or os.environ.get("https_proxy"):
    settings.setdefault("proxy", proxy)
print("[global]", *(f"{key} = {value}" for key, value in settings.items()), sep="\n")
PY
tar -C "$root" -c . | docker import - "$image" >/dev/null
