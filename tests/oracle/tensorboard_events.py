"""Reads the event files of a run with TensorBoard itself; prints {tag: [[step, value], ...]}.

Usage: tensorboard_events.py RUN_FOLDER
"""

import json
import sys

from tensorboard.backend.event_processing import event_accumulator

# 0 means all scalars, not a sample of them
reader = event_accumulator.EventAccumulator(sys.argv[1], size_guidance={event_accumulator.SCALARS: 0})
reader.Reload()
scalars = {tag: [[e.step, e.value] for e in reader.Scalars(tag)] for tag in reader.Tags()["scalars"]}
json.dump(scalars, sys.stdout)
