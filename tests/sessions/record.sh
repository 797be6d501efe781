#!/usr/bin/env bash
# Record the sessions of a release, which later versions are held to: run once for each version, never again.
set -euo pipefail
cd "$(dirname "$0")"
touchline=${1:-../../.venv/bin/touchline}
folder=$("$touchline" --version | cut -d ' ' -f 2)
mkdir "$folder"
"$touchline" simulate study-square --record "$folder/square.mcap"
"$touchline" goto 4 0.5 0 --vehicle clay-roller --record "$folder/roller.mcap"
"$touchline" goto 2 1 1.57 --vehicle turf-tank-two --record "$folder/goto.mcap"
"$touchline" fleet simulate --robots 2 --duration 4 --record "$folder/team.mcap"
