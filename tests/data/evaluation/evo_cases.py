"""What evo 1.38.1 computes of the pairs of tests/cli/evo_cases.mjs.

    node tests/cli/evo_cases.mjs FOLDER
    python tests/data/evaluation/evo_cases.py FOLDER > tests/data/evaluation/evo_cases.json
"""

import copy
import json
import sys
from pathlib import Path

from evo.core import metrics, sync
from evo.tools import file_interface

ALIGN = {"se3": {}, "sim3": {"correct_scale": True}, "scale": {"correct_only_scale": True}}


def figures(reference, estimate, is_timed, options):
    reference, estimate = copy.deepcopy(reference), copy.deepcopy(estimate)
    if is_timed:
        reference, estimate = sync.associate_trajectories(reference, estimate, max_diff=0.01)
    if options["align"] == "origin":
        estimate.align_origin(reference)
    elif options["align"] != "none":
        estimate.align(reference, **ALIGN[options["align"]])
    relation = metrics.PoseRelation[options["relation"]]
    if options["metric"] == "ape":
        metric = metrics.APE(relation)
    else:
        metric = metrics.RPE(relation, options["delta"], metrics.Unit[options["unit"]])
    metric.process_data((reference, estimate))
    return {**metric.get_all_statistics(), "num": len(metric.error)}


def main():
    folders = sorted(Path(sys.argv[1]).iterdir(), key=lambda folder: int(folder.name))
    groups = []
    for folder in folders:
        group = json.loads((folder / "group.json").read_text())
        read = file_interface.read_tum_trajectory_file
        pairs = [
            [read(folder / f"{at}_reference.tum"), read(folder / f"{at}.tum")] for at in range(len(group["isTimed"]))
        ]
        groups.append(
            [
                [figures(*pair, timed, options) for pair, timed in zip(pairs, group["isTimed"])]
                for options in group["options"]
            ]
        )
    print(json.dumps(groups, indent=None, separators=(",", ":")))


main()
