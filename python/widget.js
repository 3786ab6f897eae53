// The notebook's side of the widget; the build puts the element in front of it.

const bytesIn = (view) => new Uint8Array(view.buffer, view.byteOffset, view.byteLength);

/** Points as a file that the element takes. */
function plyOf(view, index) {
  const bytes = bytesIn(view);
  const properties = ['x', 'y', 'z'].map((axis) => `property float ${axis}\n`).join('');
  const head = `ply\nformat binary_little_endian 1.0\nelement vertex ${bytes.length / 12}\n${properties}end_header\n`;
  return new File([head, bytes], `${index}.ply`);
}

const bytesOf = (array) => new DataView(array.buffer, array.byteOffset, array.byteLength);

/** Row by row. */
function matrixOf({ x, y, z, qx, qy, qz, qw }) {
  return [
    ...[1 - 2 * (qy * qy + qz * qz), 2 * (qx * qy - qz * qw), 2 * (qx * qz + qy * qw), x],
    ...[2 * (qx * qy + qz * qw), 1 - 2 * (qx * qx + qz * qz), 2 * (qy * qz - qx * qw), y],
    ...[2 * (qx * qz - qy * qw), 2 * (qy * qz + qx * qw), 1 - 2 * (qx * qx + qy * qy), z],
    ...[0, 0, 0, 1],
  ];
}

function posesOf({ kind, result }) {
  return result.frames.map(({ T_world_sensor: pose, status }) => {
    const numbers = kind === 'planar' ? [pose.x, pose.y, pose.theta] : matrixOf(pose);
    return status === 'lost' ? numbers.map(() => Number.NaN) : numbers;
  });
}

function render({ model, el }) {
  const element = document.createElement('scanstitch-app');
  const adjust = () => {
    element.settings = model.get('settings');
    element.style.height = `${model.get('height')}px`;
  };
  const open = () => {
    const [data, names] = [model.get('_data'), model.get('_names')];
    const fileOf = (view, index) => new File([bytesIn(view)], names[index]);
    if (data.length > 0) element.open(data.map(names.length > 0 ? fileOf : plyOf)).catch(() => undefined); // told by the event
  };
  element.addEventListener('scanstitch-done', ({ detail }) => {
    const { dimensions, positions } = element.map_points;
    model.set('_dimensions', dimensions);
    model.set('_map', bytesOf(positions));
    model.set(
      'statuses',
      detail.result.frames.map(({ status }) => status),
    );
    model.set('error', '');
    model.set('_poses', bytesOf(Float64Array.from(posesOf(detail).flat())));
    model.save_changes();
  });
  element.addEventListener('scanstitch-error', ({ detail }) => {
    model.set('error', [detail.file, detail.message].filter((text) => text !== '').join(': '));
    model.save_changes();
  });
  adjust();
  model.on('change:settings', adjust);
  model.on('change:height', adjust);
  model.on('change:_data', open);
  el.append(element);
  element.updateComplete.then(open);
  return () => {
    model.off('change:settings', adjust);
    model.off('change:height', adjust);
    model.off('change:_data', open);
  };
}

export default { render };
