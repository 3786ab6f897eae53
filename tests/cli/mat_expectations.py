"""What SciPy reads in files of MATLAB, as numbers.

    pip install scipy==1.17.1
    python tests/cli/mat_expectations.py tests/data/mat/*.mat > tests/cli/mat_expectations.json

Each array has its dimensions and the CRC-32 of its numbers as doubles, little endian, column by column.
"""

import json
import sys
import zlib
from pathlib import Path

import numpy as np
from scipy.io import loadmat


def described(value):
    if value.dtype.names:
        return {name: [described(element[name]) for element in value.flat] for name in value.dtype.names}
    if value.dtype == object:
        return [described(element) for element in value.flat]
    if value.dtype.kind in "US":
        return "text"
    numbers = np.asarray(value, dtype="<f8").flatten(order="F").tobytes()
    return {"dims": list(value.shape), "crc": zlib.crc32(numbers)}


files = {}
for path in map(Path, sys.argv[1:]):
    variables = {name: value for name, value in loadmat(path).items() if not name.startswith("__")}
    files[path.name] = {name: described(value) for name, value in variables.items()}
print(json.dumps(files, indent=1))
