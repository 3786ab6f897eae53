// @ts-check
/** The camera in the words of the programs that write it, and cameras that are not those of the images. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { cameraFor, engineCamera, readCameras } from '../../npm/recording/camera_file.js';
import { readDocument } from '../../npm/recording/documents.js';
import { count, DEPTH16, encode, many, understandAll } from './recording_files.mjs';

const OPEN3D_TRAJECTORY = JSON.stringify({
  class_name: 'PinholeCameraTrajectory',
  parameters: [
    {
      class_name: 'PinholeCameraParameters',
      extrinsic: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.1, 0.2, 0.3, 1],
      intrinsic: { height: 480, width: 640, intrinsic_matrix: [525, 0, 0, 0, 525, 0, 319.5, 239.5, 1] },
    },
  ],
});

/** What each program writes, shortened where it goes on alike. @type {Record<string, string>} */
const FILES = {
  'intrinsics.csv': 'fx,fy,cx,cy,width,height\n585.5,586,320,240,640,480\n',
  'camera_matrix_de.txt': '585,500 0,000 320,000\n0,000 586,000 240,000\n0,000 0,000 1,000\n',
  'cameras.txt': '# Camera list\n#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n1 PINHOLE 640 480 525 526 320 240\n',
  'colmap_cameras.txt': '1 SIMPLE_RADIAL 640 480 500 320 240 0.01\n',
  'camera_fov.json': '{"width": 640, "height": 480, "fov": 60}',
  'camera_angle.json': '{"w": 640, "h": 480, "camera_angle_x": 1.0471975512}',
  'calibration.yml': `%YAML:1.0
---
calibration_time: "Thu 01 Jan 2024 10:00:00 AM CET"
image_width: 640
image_height: 480
flags: 0
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 5.3591573396163199e+02, 0., 3.4228315473308373e+02, 0.,
       5.3591573396163199e+02, 2.3557082909788173e+02, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -2.6637260909660682e-01, -3.8588898922304653e-02,
       1.7831947042852964e-03, -2.8122100441115472e-04,
       2.3839153080878486e-01 ]
avg_reprojection_error: 3.9259098975581364e-01
`,
  'out_camera_data.xml': `<?xml version="1.0"?>
<opencv_storage>
<calibration_time>"Wed 28 Jun 2017"</calibration_time>
<image_width>640</image_width>
<image_height>480</image_height>
<camera_matrix type_id="opencv-matrix">
  <rows>3</rows>
  <cols>3</cols>
  <dt>d</dt>
  <data>
    6.5746697944293521e+02 0. 3.1950000000000000e+02 0.
    6.5746697944293521e+02 2.3950000000000000e+02 0. 0. 1.</data></camera_matrix>
<distortion_coefficients type_id="opencv-matrix">
  <rows>5</rows><cols>1</cols><dt>d</dt>
  <data>
    -4.1802327176423804e-01 5.0715244063187526e-01 0. 0.
    -5.7843597214487474e-01</data></distortion_coefficients>
</opencv_storage>`,
  'ost.yaml': `image_width: 640
image_height: 480
camera_name: depth_A00366902105048A
camera_matrix:
  rows: 3
  cols: 3
  data: [575.8157348632812, 0, 314.5, 0, 575.8157348632812, 235.5, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [0, 0, 0, 0, 0]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
projection_matrix:
  rows: 3
  cols: 4
  data: [575.8157348632812, 0, 314.5, 0, 0, 575.8157348632812, 235.5, 0, 0, 0, 1, 0]
`,
  'camera_info.yaml': `header:
  stamp:
    sec: 1619000000
    nanosec: 12
  frame_id: camera_depth_optical_frame
height: 480
width: 848
distortion_model: plumb_bob
d:
- 0.0
- 0.0
- 0.0
- 0.0
- 0.0
k:
- 425.5
- 0.0
- 424.1
- 0.0
- 425.5
- 239.7
- 0.0
- 0.0
- 1.0
r:
- 1.0
p:
- 425.5
binning_x: 0
roi:
  x_offset: 0
  width: 0
  height: 0
---
header:
`,
  'camera_primesense.json': `{"width":640,"height":480,"intrinsic_matrix":[525.0,0.0,0.0,0.0,525.5,0.0,319.5,239.5,1.0]}`,
  'trajectory.json': OPEN3D_TRAJECTORY,
  'depth_intrinsics.json': `{"width": 640, "height": 480, "ppx": 321.2, "ppy": 238.9, "fx": 384.2, "fy": 384.2, "model": "distortion.brown_conrady", "coeffs": [0.0,0.0,0.0,0.0,0.0], "depth_scale": 0.0010000000474974513}`,
  'realsense.json': `{"color":{"width":640,"height":480,"fx":615.1,"fy":615.2,"ppx":310.1,"ppy":240.3,"coeffs":[0,0,0,0,0]},"depth":{"width":640,"height":480,"fx":384.2,"fy":384.2,"ppx":321.2,"ppy":238.9,"coeffs":[0,0,0,0,0]},"depth_scale":0.001}`,
  'rs-enumerate-camera.txt': `Device info: 
    Name                          : 	Intel RealSense D435
    Serial Number                 : 	832412061234

Intrinsic Parameters:

 Intrinsic of "Depth" / 1280x720 / {Z16}
  Width:      	1280
  Height:     	720
  PPX:        	641.1
  PPY:        	359.5
  Fx:         	640.2
  Fy:         	640.2
  Distortion: 	Brown Conrady
  Coeffs:     	0  	0  	0  	0  	0  
  FOV (deg):  	89.98 x 58.69

 Intrinsic of "Depth" / 640x480 / {Z16}
  Width:      	640
  Height:     	480
  PPX:        	320.7
  PPY:        	239.7
  Fx:         	384.12
  Fy:         	384.12
  Distortion: 	Brown Conrady
  Coeffs:     	0  	0  	0  	0  	0  
  FOV (deg):  	79.6 x 64.0

 Intrinsic of "Color" / 640x480 / {YUYV/RGB8}
  Width:      	640
  Height:     	480
  PPX:        	310.7
  PPY:        	239.7
  Fx:         	615.12
  Fy:         	615.12
`,
  'camchain.yaml': `cam0:
  cam_overlaps: []
  camera_model: pinhole
  distortion_coeffs: [-0.28, 0.07, 0.0001, 0.00002]
  distortion_model: radtan
  intrinsics: [461.629, 460.152, 362.680, 246.049]
  resolution: [752, 480]
  rostopic: /cam0/image_raw
cam1:
  T_cn_cnm1:
  - [0.99, 0.01, 0.0, -0.11]
  - [0.0, 1.0, 0.0, 0.0]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: pinhole
  distortion_coeffs: [-0.28, 0.07, 0.0001, 0.00002]
  distortion_model: radtan
  intrinsics: [460.1, 459.2, 356.4, 253.1]
  resolution: [752, 480]
`,
  'TUM1.yaml': `%YAML:1.0

#--------------------------------------------------------------------------------------------
# Camera Parameters. Adjust them!
#--------------------------------------------------------------------------------------------

# Camera calibration and distortion parameters (OpenCV) 
Camera.fx: 517.306408
Camera.fy: 516.469215
Camera.cx: 318.643040
Camera.cy: 255.313989

Camera.k1: 0.262383
Camera.k2: -0.953104
Camera.p1: -0.005358
Camera.p2: 0.002628
Camera.k3: 1.163314

Camera.width: 640
Camera.height: 480

# Deptmap values factor 
DepthMapFactor: 5000.0
`,
  'orb3.yaml': `%YAML:1.0
File.version: "1.0"
Camera.type: "PinHole"
Camera1.fx: 535.4
Camera1.fy: 539.2
Camera1.cx: 320.1
Camera1.cy: 247.6
Camera1.k1: 0.0
Camera.width: 640
Camera.height: 480
RGBD.DepthMapFactor: 5000.0
`,
  'intrinsics_size_last.txt': `525 526 319.5 239.5 640 480`,
  'intrinsics_size_first.txt': `640 480 525 526 319.5 239.5`,
  'camera-intrinsics.txt': `585 0 320\n0 585 240\n0 0 1\n`,
  'intrinsic_depth.txt': `577.870605 0.000000 319.500000 0.000000\n0.000000 577.870605 239.500000 0.000000\n0 0 1 0\n0 0 0 1\n`,
  '_info.txt': `m_versionNumber = 4
m_sensorName = StructureSensor
m_colorWidth = 1296
m_colorHeight = 968
m_depthWidth = 640
m_depthHeight = 480
m_depthShift = 1000
m_calibrationColorIntrinsic = 1170.187988 0 647.750000 0 0 1170.187988 483.750000 0 0 0 1 0 0 0 0 1 
m_calibrationColorExtrinsic = 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 
m_calibrationDepthIntrinsic = 571.623718 0 319.500000 0 0 571.623718 239.500000 0 0 0 1 0 0 0 0 1 
m_calibrationDepthExtrinsic = 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 
m_frames.size = 5578
`,
  'scene0000_00_info.txt': `axisAlignment = 0.945519 0.325568 0.000000 -5.384390 -0.325568 0.945519 0.000000 -2.871780 0.000000 0.000000 1.000000 -0.064350 0.000000 0.000000 0.000000 1.000000 
colorHeight = 968
colorToDepthExtrinsics = 0.999973 0.006791 0.002776 -0.037886 -0.006767 0.999942 -0.008366 -0.003410 -0.002833 0.008347 0.999961 -0.021924 -0.000000 0.000000 -0.000000 1.000000
colorWidth = 1296
depthHeight = 480
depthWidth = 640
fx_color = 1170.187988
fx_depth = 571.623718
fy_color = 1170.187988
fy_depth = 571.623718
mx_color = 647.750000
mx_depth = 319.500000
my_color = 483.750000
my_depth = 239.500000
numColorFrames = 5578
sceneType = Apartment
`,
  'scene_camera.json': `{
  "0": {"cam_K": [1066.778, 0.0, 312.9869, 0.0, 1067.487, 241.3109, 0.0, 0.0, 1.0], "depth_scale": 0.1},
  "1": {"cam_K": [1066.778, 0.0, 312.9869, 0.0, 1067.487, 241.3109, 0.0, 0.0, 1.0], "depth_scale": 0.1}
}`,
  'cam_params.json': `{"camera": {"w": 1200, "h": 680, "fx": 600.0, "fy": 600.0, "cx": 599.5, "cy": 339.5, "scale": 6553.5}}`,
  'replica.yaml': `dataset: 'replica'
meshing:
  eval_rec: True
cam:
  H: 680
  W: 1200
  fx: 600.0
  fy: 600.0
  cx: 599.5
  cy: 339.5
  png_depth_scale: 6553.5 #for depth image in png format
  crop_edge: 0
`,
  'transforms.json': `{"fl_x": 600, "fl_y": 601, "cx": 320, "cy": 240, "w": 640, "h": 480, "k1": 0, "frames": [{"file_path":"a.png","transform_matrix":[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]}`,
  'calibration.json': JSON.stringify({
    CalibrationInformation: {
      Cameras: [
        {
          Intrinsics: {
            ModelParameterCount: 14,
            ModelParameters: [0.5159, 0.5165, 0.4928, 0.4929, 5.2, 3.5, 0.17, 5.5, 5.2, 0.9, 0, 0, -0.00003, 0.00005],
            ModelType: 'CALIBRATION_LensDistortionModelBrownConrady',
          },
          Location: 'CALIBRATION_CameraLocationD0',
          Purpose: 'CALIBRATION_CameraPurposeDepth',
          SensorHeight: 1024,
          SensorWidth: 1024,
        },
        {
          Intrinsics: {
            ModelParameterCount: 14,
            ModelParameters: [0.4986, 0.5009, 0.4748, 0.633, 0.3, -2, 1, 0.2, -2, 1, 0, 0, 0, 0],
          },
          Location: 'CALIBRATION_CameraLocationPV0',
          SensorHeight: 3072,
          SensorWidth: 4096,
        },
      ],
    },
  }),
  'sensor.yaml': `sensor_type: camera
comment: VI-Sensor cam0 (MT9M034)

# Sensor extrinsics wrt. the body-frame.
T_BS:
  cols: 4
  rows: 4
  data: [0.0148655429818, -0.999880929698, 0.00414029679422, -0.0216401454975,
         0.999557249008, 0.0149672133247, 0.025715529948, -0.064676986768,
        -0.0257744366974, 0.00375618835797, 0.999660727178, 0.00981073058949,
         0.0, 0.0, 0.0, 1.0]

# Camera specific definitions.
rate_hz: 20
resolution: [752, 480]
camera_model: pinhole
intrinsics: [458.654, 457.296, 367.215, 248.375] #fu, fv, cu, cv
distortion_model: radial-tangential
distortion_coefficients: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]
`,
  'metadata.json': `{"w":256,"h":192,"K":[212.5,0,0,0,212.5,0,127.9,95.8,1],"fps":60,"poses":[[0,0,0,1,0,0,0]]}`,
  'camera.txt': `fx = 525.0\nfy = 525.0\ncx = 319.5\ncy = 239.5\ndepth factor: 5000\n`,
  'infinitam_calib.txt': `640 480\n573.71 574.394\n346.471 249.031\n\n640 480\n570 571\n320 240\n\n1 0 0 0\n0 1 0 0\n0 0 1 0\n\naffine 0.001 0.0\n`,
  'infinitam_disparity.txt': `640 480\r\n573 574\r\n346 249\r\n\r\n640 480\r\n570 571\r\n320 240\r\n\r\n1 0 0 0\r\n0 1 0 0\r\n0 0 1 0\r\n\r\n1135 0.08\r\n`,
  'zed_camera.conf': `[LEFT_CAM_HD]\nfx=699.9\nfy=699.8\ncx=660.4\ncy=360.5\nk1=-0.17\n\n[LEFT_CAM_VGA]\nfx=349\nfy=349\ncx=330\ncy=180\n`,
};

/** Size of the depth images, fx fy cx cy, raw values per metre. @type {Record<string, [number[], number[], number | null]>} */
const EXPECTED = {
  'intrinsics.csv': [[640, 480], [585.5, 586, 320, 240], null],
  'camera_matrix_de.txt': [[640, 480], [585.5, 586, 320, 240], null],
  'calibration.yml': [[640, 480], [535.916, 535.916, 342.283, 235.571], null],
  'out_camera_data.xml': [[640, 480], [657.467, 657.467, 319.5, 239.5], null],
  'ost.yaml': [[640, 480], [575.816, 575.816, 314.5, 235.5], null],
  'camera_primesense.json': [[640, 480], [525, 525.5, 319.5, 239.5], null],
  'trajectory.json': [[640, 480], [525, 525, 319.5, 239.5], null],
  'depth_intrinsics.json': [[640, 480], [384.2, 384.2, 321.2, 238.9], 1000],
  'realsense.json': [[640, 480], [384.2, 384.2, 321.2, 238.9], 1000],
  'rs-enumerate-camera.txt': [[640, 480], [384.12, 384.12, 320.7, 239.7], null],
  'TUM1.yaml': [[640, 480], [517.306, 516.469, 318.643, 255.314], 5000],
  'orb3.yaml': [[640, 480], [535.4, 539.2, 320.1, 247.6], 5000],
  'cameras.txt': [[640, 480], [525, 526, 319.5, 239.5], null],
  'colmap_cameras.txt': [[640, 480], [500, 500, 319.5, 239.5], null],
  'camera_fov.json': [[640, 480], [554.256, 554.256, 319.5, 239.5], null],
  'camera_angle.json': [[640, 480], [554.256, 554.256, 319.5, 239.5], null],
  'intrinsics_size_last.txt': [[640, 480], [525, 526, 319.5, 239.5], null],
  'intrinsics_size_first.txt': [[640, 480], [525, 526, 319.5, 239.5], null],
  'camera-intrinsics.txt': [[640, 480], [585, 585, 320, 240], null],
  'intrinsic_depth.txt': [[640, 480], [577.871, 577.871, 319.5, 239.5], null],
  '_info.txt': [[640, 480], [571.624, 571.624, 319.5, 239.5], 1000],
  'scene0000_00_info.txt': [[640, 480], [571.624, 571.624, 319.5, 239.5], null],
  'scene_camera.json': [[640, 480], [1066.778, 1067.487, 312.987, 241.311], 10000],
  'transforms.json': [[640, 480], [600, 601, 320, 240], null],
  'camera.txt': [[640, 480], [525, 525, 319.5, 239.5], 5000],
  'camera_info.yaml': [[848, 480], [425.5, 425.5, 424.1, 239.7], null],
  'camchain.yaml': [[752, 480], [461.629, 460.152, 362.68, 246.049], null],
  'cam_params.json': [[1200, 680], [600, 600, 599.5, 339.5], 6553.5],
  'replica.yaml': [[1200, 680], [600, 600, 599.5, 339.5], 6553.5],
  'calibration.json': [[640, 576], [504.627, 504.73, 335.782, 348.396], null],
  'sensor.yaml': [[752, 480], [458.654, 457.296, 367.215, 248.375], null],
  'metadata.json': [[256, 192], [212.5, 212.5, 127.9, 95.8], null],
  'infinitam_calib.txt': [[640, 480], [570, 571, 320, 240], null],
  'infinitam_disparity.txt': [[640, 480], [570, 571, 320, 240], null],
  'zed_camera.conf': [[672, 376], [349, 349, 330, 180], null],
};

/** @param {string} name @param {number} width @param {number} height */
function read(name, width, height) {
  return cameraFor(name, encode(FILES[name] ?? ''), { width, height });
}

test('the camera of each program, with its depth scale', () => {
  assert.deepEqual(Object.keys(EXPECTED).toSorted(), Object.keys(FILES).toSorted());
  for (const [name, [[width = 0, height = 0], expected, scale]] of Object.entries(EXPECTED)) {
    const { fx, fy, cx, cy, depth_scale } = read(name, width, height).camera;
    assert.deepEqual(
      [fx, fy, cx, cy].map((value) => Math.round(1000 * value) / 1000),
      expected,
      name,
    );
    assert.equal(depth_scale, scale, name);
  }
});

test('beside depth images each is found by its name or by what is in it', async () => {
  const images = many(count(1, 3), (i) => `scene/depth/${i}.png`, DEPTH16);
  for (const name of Object.keys(FILES)) {
    const { intrinsics, notes } = await understandAll({ ...images, [`scene/${name}`]: FILES[name] ?? '' });
    const [width = 0, height = 1] = EXPECTED[name]?.[0] ?? [];
    const isRefused = width / height !== 640 / 480;
    // Without a size in the file nothing tells that it is for another one.
    if (name !== 'zed_camera.conf') assert.equal(intrinsics, isRefused ? null : `scene/${name}`, name);
    if (isRefused && name !== 'zed_camera.conf') assert.match(notes[0]?.reason ?? '', /^not used: This camera/, name);
    assert.equal(notes.filter(({ reason }) => reason.startsWith('not used: neither')).length, 0, name);
  }
});

test('another size: scaled where it is the same image, refused in plain words where it is not', () => {
  const { camera, notes } = read('camera_primesense.json', 320, 240);
  assert.deepEqual([camera.fx, camera.cx, camera.cy], [262.5, 159.5, 119.5]);
  assert.deepEqual(notes, ["the camera of 640 x 480 pixels is scaled to the depth images' 320 x 240"]);
  assert.throws(
    () => read('camera_primesense.json', 1280, 720),
    /camera_primesense\.json: This camera is for 640 x 480 pixels, the depth images have 1280 x 720\. Give the camera of the depth images\./,
  );
  assert.throws(
    () => read('camera-intrinsics.txt', 256, 144),
    /This camera \(fx 585, principal point \(320, 240\)\) cannot have taken depth images of 256 x 144 pixels/,
  );
  // It does not say its size, but its principal point does where the aspect is the same.
  const small = read('camera-intrinsics.txt', 256, 192);
  assert.deepEqual([small.camera.fx, small.camera.cx.toFixed(1), small.camera.cy.toFixed(1)], [234, '127.7', '95.7']);
  assert.match(small.notes[0] ?? '', /by its principal point, the camera of 640 x 480 pixels is scaled/);
  assert.match(read('camera-intrinsics.txt', 1280, 720).notes[0] ?? '', /far from the middle of images of 1280 x 720/);
});

test('a field of view that does not say between which sides is told as taken', () => {
  assert.match(
    read('camera_fov.json', 640, 480).notes.join(),
    /taken from side to side; of one from top to bottom, give fx/,
  );
  assert.deepEqual(read('camera_angle.json', 640, 480).notes, []);
});

test('lens distortion is told, and not applied', () => {
  const [note] = read('TUM1.yaml', 640, 480).notes;
  assert.equal(
    note,
    'its lens distortion (0.262, -0.953, -0.00536) is not applied: depth images are taken as rectified',
  );
  assert.deepEqual(read('ost.yaml', 640, 480).notes, []);
});

/** EXIF data with numbers under these tags, as cameras write them. @param {[tag: number, type: 3 | 5, value: number][]} entries */
function exif(entries) {
  const view = new DataView(new ArrayBuffer(26 + 20 * entries.length + 6));
  [0x49, 0x49, 42, 0].forEach((byte, at) => view.setUint8(at, byte));
  view.setUint32(4, 8, true);
  const write = (
    /** @type {number} */ at,
    /** @type {[number, 3 | 4 | 5, number]} */ [tag, type, value],
    place = 0,
  ) => {
    view.setUint16(at, tag, true);
    view.setUint16(at + 2, type, true);
    view.setUint32(at + 4, 1, true);
    if (type === 3) view.setUint16(at + 8, value, true);
    if (type === 4) view.setUint32(at + 8, value, true);
    if (type !== 5) return;
    view.setUint32(at + 8, place, true);
    view.setUint32(place, Math.round(value * 1000), true);
    view.setUint32(place + 4, 1000, true);
  };
  view.setUint16(8, 1, true);
  write(10, [0x8769, 4, 26]);
  view.setUint16(26, entries.length, true);
  entries.forEach((entry, i) => write(28 + 12 * i, entry, 28 + 12 * entries.length + 8 * i));
  return new Uint8Array(view.buffer);
}

/** @param {Uint8Array} data */
function jpeg(data) {
  return Uint8Array.of(0xff, 0xd8, 0xff, 0xe1, 0, data.length + 8, ...encode('Exif\0\0'), ...data, 0xff, 0xda);
}

test('the EXIF data of a colour picture give the focal length where no file does', async () => {
  const film = jpeg(exif([[0xa405, 3, 26]]));
  const sensor = exif([
    [0x920a, 5, 4.25],
    [0xa20e, 5, 8000],
    [0xa210, 3, 3],
    [0xa002, 3, 4000],
    [0xa003, 3, 3000],
  ]);
  const expected = [(26 / 43.27) * 800, ((4.25 * 800) / 5000) * 800];
  const png = Uint8Array.of(...DEPTH16, ...encode('eXIf'), ...sensor);
  for (const [index, picture] of [film, png].entries()) {
    const { fx, fy, cx } = cameraFor('1.jpg', picture, { width: 640, height: 480 }).camera;
    assert.ok(Math.abs(fx - (expected[index] ?? 0)) < 0.01 && fx === fy && cx === 319.5, `${fx}`);
  }
  const images = {
    ...many(count(1, 3), (i) => `depth/${i}.png`, DEPTH16),
    ...many(count(1, 3), (i) => `rgb/${i}.jpg`, film),
  };
  const { intrinsics, notes } = await understandAll(images);
  assert.equal(intrinsics, 'rgb/1.jpg');
  assert.match(notes[0]?.reason ?? '', /EXIF data give the focal length, 480\.7 pixels/);
  assert.equal((await understandAll({ ...images, 'camera.txt': '585 585 320 240\n' })).intrinsics, 'camera.txt');
  for (const broken of [film.subarray(0, 20), jpeg(new Uint8Array(30)), jpeg(exif([]))]) {
    assert.throws(() => cameraFor('1.jpg', broken, { width: 640, height: 480 }), /No camera was found/);
  }
});

test('files that describe no camera', () => {
  const rotation = '1 0 0\n0 1 0\n0 0 1\n';
  const fisheye = 'cam0:\n  camera_model: omni\n  intrinsics: [1.2, 461.6, 460.1, 362.6, 246.0]\n';
  for (const text of [
    '',
    'hello: world\nlist:\n  - a\n  - b: 3\n',
    rotation,
    '{"fx": 585}',
    '['.repeat(1e5),
    fisheye,
    '<a><b>',
  ]) {
    assert.deepEqual(readCameras(encode(text)), [], text.slice(0, 40));
  }
  assert.throws(() => cameraFor('K.txt', encode(rotation), null), /K\.txt: No camera was found in this file/);
  const { camera } = cameraFor('K.txt', encode('585 580 320 240'), null);
  assert.equal(new TextDecoder().decode(engineCamera(camera)), '{"fx":585,"fy":580,"cx":320,"cy":240}');
});

test('the part of YAML that is read', () => {
  const text = `%YAML:1.0
---
a: [1, 2.5, # comment
    "three"]   # of three
b:
- - 1
  - 2
- x: 1
  y: { z: 2, w: [] }
"c d": 'e: f'
empty:
g: !!opencv-matrix
   rows: 1
   data: [ 1e3, .5 ]
---
second: 1
`;
  assert.deepEqual(JSON.parse(JSON.stringify(readDocument(text))), {
    a: [1, 2.5, 'three'],
    b: [[1, 2], { x: 1, y: { z: 2, w: [] } }],
    'c d': 'e: f',
    empty: null,
    g: { rows: 1, data: [1000, 0.5] },
  });
});
