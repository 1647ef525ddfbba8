"""A throw-away Slurm on this machine for the tests: munged, slurmctld and slurmd with a configuration of their own.

As root, without systemd, cgroups or a database; tried with Slurm 22.05 of Debian 12 (packages slurmctld, slurmd, slurm-client,
munge). Everything it writes is in one folder, it listens on 127.0.0.1 only, and it is stopped by its recorded process numbers.
"""

from __future__ import annotations

import os
import pathlib
import shutil
import signal
import socket
import subprocess
import time

NEEDED = ("munged", "slurmctld", "slurmd", "sbatch", "squeue", "sinfo", "scancel")
CONFIGURATION = """\
ClusterName=unilat
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
CommunicationParameters=NoInAddrAny,NoCtldInAddrAny
SlurmUser=root
SlurmdUser=root
SlurmdParameters=config_overrides
AuthType=auth/munge
AuthInfo=socket={folder}/munge/munge.socket
CredType=cred/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SwitchType=switch/none
MpiDefault=none
ReturnToService=2
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=sched_interval=1,sched_min_interval=0
AccountingStorageType=accounting_storage/none
KillWait=2
NodeName={host} NodeAddr=127.0.0.1 CPUs={slots} RealMemory=1000 State=UNKNOWN
PartitionName=local Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


def why_not() -> str:
    """Why it cannot be started here; empty when it can."""
    missing = [name for name in NEEDED if shutil.which(name) is None]
    if missing:
        return f"no Slurm here ({', '.join(missing)} missing)"
    if os.getuid() != 0:
        return "a Slurm of its own needs root"
    return ""


class SlurmMachine:
    """Runs from start() to stop(); clients need `environment`."""

    def __init__(self, folder: pathlib.Path, slots: int = 4):
        self.folder, self.slots = folder, slots
        self.environment = {**os.environ, "SLURM_CONF": str(folder / "slurm.conf")}

    def start(self):
        for name, mode in ((".", 0o755), ("munge", 0o755), ("state", 0o700), ("spool", 0o755)):
            (self.folder / name).mkdir(exist_ok=True, parents=True)
            (self.folder / name).chmod(mode)
        host = socket.gethostname().split(".")[0]
        sockets = [socket.socket() for _ in range(2)]
        for each in sockets:
            each.bind(("127.0.0.1", 0))
        ports = [each.getsockname()[1] for each in sockets]
        for each in sockets:
            each.close()
        (self.folder / "slurm.conf").write_text(CONFIGURATION.format(host=host, ports=ports, folder=self.folder, slots=self.slots))
        key = self.folder / "munge" / "key"
        key.write_bytes(os.urandom(1024))
        key.chmod(0o400)
        self._call("munged", f"--key-file={key}", f"--socket={self.folder}/munge/munge.socket",
                   f"--pid-file={self.folder}/munged.pid", f"--log-file={self.folder}/munged.log",
                   f"--seed-file={self.folder}/munge/seed", "--num-threads=2", "--force")
        self._call("slurmctld", "-c")
        self._call("slurmd", "-N", host)
        end = time.monotonic() + 30.0
        while self._call("sinfo", "-h", "-o", "%t", check=False).strip() != "idle":
            if time.monotonic() > end:
                raise RuntimeError("the node did not become idle: " + (self.folder / "slurmctld.log").read_text()[-2000:])
            time.sleep(0.1)

    def stop(self):
        """Each daemon takes up to two seconds to end, and removes its own file: read all numbers, ask all, then wait."""
        self._call("scancel", "-u", "root", check=False)
        files = [self.folder / f"{name}.pid" for name in ("slurmd", "slurmctld", "munged")]
        pids = [int(file.read_text()) for file in files if file.exists()]
        for pid in pids:
            os.kill(pid, signal.SIGTERM)
        end = time.monotonic() + 10.0
        while pids and time.monotonic() < end:
            pids = [pid for pid in pids if os.path.exists(f"/proc/{pid}")]
            time.sleep(0.1)
        for pid in pids:
            os.kill(pid, signal.SIGKILL)

    def _call(self, *words: str, check: bool = True) -> str:
        done = subprocess.run(words, env=self.environment, capture_output=True, text=True, check=False)
        if check and done.returncode:
            raise RuntimeError(f"{words[0]}: {done.stderr}")
        return done.stdout
