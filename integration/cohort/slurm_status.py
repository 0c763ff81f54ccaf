"""Says for Snakemake whether a job of Slurm runs, ended well or failed: from the controller, so that no accounting is needed."""

import re
import subprocess
import sys

# What a job that the controller has on its list may come to yet. REQUEUED: its node went away, and it begins again elsewhere.
RUNNING = {"CONFIGURING", "COMPLETING", "PENDING", "PREEMPTED", "REQUEUED", "REQUEUE_FED", "REQUEUE_HOLD", "RESIZING", "RESV_DEL_HOLD",
           "RUNNING", "SIGNALING", "SPECIAL_EXIT", "STAGE_OUT", "STOPPED", "SUSPENDED"}

job = sys.argv[1]
shown = subprocess.run(["scontrol", "-o", "show", "job", job], capture_output=True, text=True, check=False)
state = re.search(r"\bJobState=(\S+)", shown.stdout)
if state:
    print("success" if state[1] == "COMPLETED" else "running" if state[1] in RUNNING else "failed")
elif "Invalid job id" in shown.stderr:
    # The controller forgets jobs some minutes after their end; then only the accounting knows, where there is one.
    told = subprocess.run(["sacct", "-X", "-n", "-P", "-o", "State", "-j", job], capture_output=True, text=True, check=False)
    word = told.stdout.split()[:1]
    print("success" if word == ["COMPLETED"] else "failed")
else:
    # The controller does not answer: it may be restarting, and Snakemake asks again.
    print("running")
