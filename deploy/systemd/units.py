#!/usr/bin/env python3
"""The units of a vehicle, from the process table: units.py TABLE OUT writes OUT/chase.target and one
OUT/chase-NAME.service for each process that a vehicle has."""

import pathlib
import shutil
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "launcher"))
sys.dont_write_bytecode = True

import bus  # noqa: E402
import processes  # noqa: E402
import script  # noqa: E402

TARGET = """# Everything that flies. `systemctl mask chase-viewer` leaves one out.
[Unit]
Description=chase: fly behind a moving target
Documentation=file:/usr/share/doc/chase/DEPLOYMENT.md
Wants={services}

[Install]
WantedBy=multi-user.target
"""

SERVICE = """[Unit]
Description=chase: {name}
Documentation=man:{binary}(1)
PartOf=chase.target
Requires=chase-network.service
# A clock that is set in flight ages every message at once.
Wants=time-sync.target
After=chase-network.service network.target time-sync.target
# In flight nothing is given up.
StartLimitIntervalSec=0

[Service]
# Ready when its bus works; gives a sign of life every second.
Type=notify
WatchdogSec=5
Restart={systemd_restart}
# chase-fcu hands over 0.5 s after the last setpoint; back-off, below, delays what keeps dying.
RestartSec=50ms
{back_off}Environment="LCM_DEFAULT_URL={url}"
EnvironmentFile=-/etc/chase/environment
ExecStart=/usr/bin/{binary} --config /etc/chase/{name}.yaml $CHASE_OPTIONS
KillSignal=SIGINT
TimeoutStopSec=5
{scheduling}User=chase
# For the devices of the camera and the autopilot.
SupplementaryGroups=video dialout
NoNewPrivileges=true
PrivateTmp=true
ProtectHome=true
# The one place to write to: save_map: map.bt becomes /var/lib/chase/map.bt.
ProtectSystem=strict
StateDirectory=chase
WorkingDirectory=%S/chase
"""


# Of the table. A watchdog that barks, a signal and an end of its own accord alike: nothing in flight is done.
RESTART = {"always": "always", "never": "no"}
# systemd 252, Debian 12's, has no RestartSteps=; and StartLimitBurst= gives up. It is no reason not to start.
BACK_OFF = """# Dies it soon after each start, it is started ever later.
RuntimeDirectory=%N
RuntimeDirectoryPreserve=restart
ExecStartPre=-/usr/libexec/chase/back-off
"""


def scheduling(row):
    lines = []
    if row["priority"]:  # below 50, where a real-time kernel has its interrupts
        lines += ["CPUSchedulingPolicy=fifo", f"CPUSchedulingPriority={row['priority']}"]
    if row["nice"]:
        lines.append(f"Nice={row['nice']}")
    if row["cores"]:
        lines.append(f"CPUAffinity={row['cores']}")
    return "".join(line + "\n" for line in lines)


def main():
    table, out = map(pathlib.Path, script.arguments(__doc__, 2, 2))
    rows = [row for row in processes.read_table(table.read_bytes(), table.name) if row["vehicle"]]
    shutil.rmtree(out, ignore_errors=True)  # units of rows that are gone
    out.mkdir(parents=True)
    for row in rows:
        text = SERVICE.format(**row, url=bus.DEFAULT_URL, scheduling=scheduling(row),
                              systemd_restart=RESTART[row["restart"]],
                              back_off=BACK_OFF if row["restart"] == "always" else "")
        (out / f"chase-{row['name']}.service").write_text(text, encoding="utf-8")
    services = " ".join(f"chase-{row['name']}.service" for row in rows)
    (out / "chase.target").write_text(TARGET.format(services=services), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
