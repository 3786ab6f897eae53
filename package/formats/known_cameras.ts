/**
 * Cameras of published data sets whose recordings hold no file that says them, told by the names that the sets give their
 * folders and paths. All have images of 640 x 480 pixels and 5,000 raw values per metre.
 *
 * Sources: TUM RGB-D, "File formats", table of the intrinsics (colours; the depth is registered to them); BONN RGB-D Dynamic,
 * its web page; ICL-NUIM (Handa et al., ICRA 2014), its web page: fy is -480 for the renderer, 480 for its images.
 */

const CAMERAS: readonly { name: string; is: RegExp; camera: [fx: number, fy: number, cx: number, cy: number] }[] = [
  { name: 'TUM RGB-D, freiburg1', is: /(^|\/)rgbd_dataset_freiburg1_[^/]*\//i, camera: [517.3, 516.5, 318.6, 255.3] },
  { name: 'TUM RGB-D, freiburg2', is: /(^|\/)rgbd_dataset_freiburg2_[^/]*\//i, camera: [520.9, 521.0, 325.1, 249.7] },
  { name: 'TUM RGB-D, freiburg3', is: /(^|\/)rgbd_dataset_freiburg3_[^/]*\//i, camera: [535.4, 539.2, 320.1, 247.6] },
  { name: 'BONN RGB-D', is: /(^|\/)rgbd_bonn_[^/]*\//i, camera: [542.8, 542.6, 315.6, 237.8] },
  {
    name: 'ICL-NUIM',
    is: /(^|\/)(livingroom|office|traj)\w*\.gt\.freiburg$/i,
    camera: [481.2, 480, 319.5, 239.5],
  },
];
/** Files that may say it themselves. */
const CAMERA_NAMES = /\.(ya?ml|json)$|(cam|calib|intrin)[^/]*$/i;

/**
 * The camera of a data set, as ORB-SLAM's settings have it; null where none is known, or a file may say it.
 * @returns at: the path that tells it
 */
export function knownCamera(files: readonly { path: string }[]): { at: string; text: string; reason: string } | null {
  if (files.some(({ path }) => CAMERA_NAMES.test(path))) return null;
  for (const { name, is, camera } of CAMERAS) {
    const at = files.find(({ path }) => is.test(path))?.path;
    if (at === undefined) continue;
    const [fx, fy, cx, cy] = camera;
    const size = 'Camera.width: 640\nCamera.height: 480\n';
    const text = `%YAML:1.0\n${size}Camera.fx: ${fx}\nCamera.fy: ${fy}\nCamera.cx: ${cx}\nCamera.cy: ${cy}\nDepthMapFactor: 5000.0\n`;
    const reason = `named as in ${name}: the camera of that data set (fx ${fx}, fy ${fy}, cx ${cx}, cy ${cy}) and its 5,000 raw values per metre are used`;
    return { at, text, reason };
  }
  return null;
}
