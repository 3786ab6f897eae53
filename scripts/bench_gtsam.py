"""GTSAM on pose graphs, beside scripts/bench_graphs.mjs: Levenberg-Marquardt from the poses of the file, until the error falls by less
than a share of 1e-10.

pip install gtsam; OMP_NUM_THREADS=1 taskset -c 0 python scripts/bench_gtsam.py FILE.g2o...
"""

import sys
import time
from pathlib import Path

import gtsam

NUM_RUNS = 5


def run(path: str):
    in_space = 'SE3' in Path(path).read_text()
    read, start = gtsam.readG2o(path, in_space)
    graph, first = gtsam.NonlinearFactorGraph(read), min(start.keys())
    # The first pose stays, as tightly as GTSAM's own examples hold it.
    if in_space:
        prior = gtsam.PriorFactorPose3(first, start.atPose3(first), gtsam.noiseModel.Isotropic.Sigma(6, 1e-4))
    else:
        prior = gtsam.PriorFactorPose2(first, start.atPose2(first), gtsam.noiseModel.Isotropic.Sigma(3, 1e-4))
    graph.add(prior)
    parameters = gtsam.LevenbergMarquardtParams()
    parameters.setMaxIterations(200)
    parameters.setRelativeErrorTol(1e-10)
    begin = time.process_time()
    optimizer = gtsam.LevenbergMarquardtOptimizer(graph, start, parameters)
    found = optimizer.optimize()
    return 1e3 * (time.process_time() - begin), optimizer.iterations(), 2 * graph.error(found)


for path in sys.argv[1:]:
    runs = [run(path) for _ in range(NUM_RUNS)]
    times = ' '.join(f'{milliseconds:.0f}' for milliseconds, _, _ in runs)
    print(f'{Path(path).name}: {times} ms, {runs[0][1]} steps, chi squared {runs[0][2]}')
