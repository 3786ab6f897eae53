/** Formats that are not read, and the one line that helps: which program converts them, with the command. */
import type { Note } from '../base/errors.js';
import { nameOf, seriesOf } from '../files/names.js';
import type { ListedFile } from '../files/recording.js';

/** By how a name ends. */
const ADVICE: readonly [RegExp, string][] = [
  [/\.(zip|tar|tgz)$/i, 'an archive within an archive or a folder, which is not opened; unpack it, or give it alone'],
  [/\.(tar\.xz|txz)$/i, 'an archive packed by xz, which is not opened; unpack it (tar xf FILE) and give the folder'],
  [/\.7z$/i, 'an archive of 7-Zip, which is not opened; unpack it (7z x FILE) and give the folder'],
  [/\.rar$/i, 'an archive of RAR, which is not opened; unpack it (unrar x FILE) and give the folder'],
  [/\.xz$/i, 'packed by xz; unpack it (unxz FILE) and give what comes out'],
  [/\.db3-(wal|shm|journal)$/i, 'belongs to a bag that was not closed; give it together with its .db3'],
  [
    /\.(stl|off|gltf|glb|fbx|dae|usdz|3ds)$/i,
    'a mesh, which is not read; save its vertices as PLY (MeshLab or CloudCompare)',
  ],
  [/\.rawlog$/i, 'a rawlog of MRPT, which is not read; export its scans: rawlog-edit --export-2d-scans-txt -i FILE'],
  [
    /\.(h5|hdf5)$/i,
    "HDF5, which is not read; save the array as text: numpy.savetxt('ranges.csv', array, delimiter=',')",
  ],
  [
    /(^|\/)times(tamps)?\.txt$/i,
    'times that are not those of the frames: a line each, ascending, beside clouds; depth images have theirs in their names',
  ],
  [/\.(pkl|pickle)$/i, "a pickle, which runs code when it is read; save the array: numpy.save('ranges.npy', array)"],
  [
    /\.(parquet|feather)$/i,
    "a table of Arrow; save it as text: pandas.read_parquet('FILE').to_csv('scans.csv', index=False)",
  ],
  [/\.(xlsx?|ods)$/i, 'a spreadsheet; save it as CSV: libreoffice --headless --convert-to csv FILE'],
  [/\.pbstream$/i, 'a state of Cartographer, which holds its map and no scans; give the bag that it was made of'],
  [
    /\.(g2o|toro|graph)$/i,
    'a graph of poses without scans; give the log or bag of the laser; its poses alone are compared as text, id x y theta',
  ],
  [
    /\.pcap(ng)?$/i,
    'packets of a network; save the points: with VeloView or Ouster Studio as CSV or LAS, or play them into a ROS bag',
  ],
  [/\.lvx2?$/i, 'a recording of Livox Viewer; export it there as CSV, LAS or PCD'],
  [/\.vt[kpu]$/i, 'data of VTK; save its points as PLY (ParaView: File, Save Data)'],
  [/\.(dxf|dwg|ifc|step|stp|rvt)$/i, 'a drawing, which holds no measurements'],
  [
    /\.(rcp|rcs|fls|zfs|pod)$/i,
    "a scan in its maker's own format; export it as E57, PTS or LAS and that as PLY (CloudCompare)",
  ],
  [
    /\.r3d$/i,
    'a recording of Record3D, whose depth is packed by LZFSE; export it in the app as a sequence of PLY files, which are read',
  ],
  [/\.gfs$/i, "a log of GMapping's viewer; convert it to CARMEN's: gfs2log FILE scans.log"],
  [/\.(script|rec)$/i, 'a script of BeeSoft, which is not read; write a scan a line as numbers: x y theta r1 r2 ...'],
  [
    /\.3d$/i,
    "a scan of 3DTK (cm; x right, y up, z ahead); write it as x y z in metres: awk '{print $3/100, -$1/100, $2/100}' FILE > scan.xyz",
  ],
  [
    /(^|\/)rgbd\/\d+\.(depth|conf)$/i,
    'the depth of a recording of Record3D, packed by LZFSE; export it in the app as a sequence of PLY files, which are read',
  ],
  [/\.depth$/i, 'a depth image in a form of its own; save it as PNG of 16 bits in mm, or as numpy.save(...)'],
  [
    /\.sens$/i,
    'a recording of ScanNet; take its images out: python reader.py --filename FILE --output_path out --export_depth_images --export_color_images --export_poses --export_intrinsics',
  ],
  [/\.(heic|heif|dng|cr2|nef|arw)$/i, 'a photograph, and no depth image; photogrammetry is done by COLMAP or Meshroom'],
  [/\.(aedat4?|raw3|prophesee)$/i, 'events of an event camera, which are not read'],
  [/\.exr$/i, "an image of OpenEXR; save its depth: numpy.save('depth_0.npy', depth), in metres"],
  [/\.svo2?$/i, 'a recording of a ZED; export depth and images: ZED_SVO_Export FILE out/ 4'],
  [/\.oni$/i, 'a recording of OpenNI; export its depth images with NiViewer, or play it into a ROS bag'],
  [/\.klg$/i, 'a log of ElasticFusion, which is not read; export its frames as images of 16 bits: PNG'],
  [
    /\.(rrd|mvlog)$/i,
    'a log for a viewer, which is not read; give what it was logged from, or export the points as PLY',
  ],
  [/\.(ipynb|m|py|cpp|hpp|launch|sdf|urdf|xacro|world|rviz)$/i, 'a program or a description, and no recording'],
  [
    /(\.lcm$|(^|\/)lcmlog-[\w.-]*$)/i,
    'a log of LCM, which is not read; play it (lcm-logplayer FILE) and write each scan as a line of numbers: time r1 r2 ...',
  ],
  [/\.tfrecords?$/i, 'records of TensorFlow, which are not read; save the clouds: numpy.save(f"{frame}.npy", points)'],
  [
    /\.(nmea|ubx|gpx|rinex)$/i,
    'positions of a satellite receiver, without scans; give the recording of the laser or the camera',
  ],
  [/\.bag\.active$/i, 'a bag that its recorder did not close; repair it: rosbag reindex FILE'],
  [
    /\.mkv$/i,
    "a film; where an Azure Kinect recorded it, take its depth out by Open3D's azure_kinect_mkv_reader.py: python azure_kinect_mkv_reader.py --input FILE --output out",
  ],
  [
    /\.(posegraph|data)$/i,
    'a map of slam_toolbox, which is not read; give the bag that it was made of: ros2 bag record /scan /odom /tf /tf_static',
  ],
  [/\.stcm$/i, "a map of SLAMTEC's RoboStudio, which holds no scans; record the scans: ros2 bag record /scan"],
  [/\.osf$/i, 'a recording of Ouster; save it as a bag or as clouds: ouster-cli source FILE save out.bag'],
  [
    /\.(geometric|photometric)\.bin$/i,
    "a depth map of COLMAP; save it as an array: numpy.save('depth_0.npy', read_array(FILE)), by its read_write_dense.py",
  ],
  [
    /\.bin$/i,
    "numbers whose layout is not known: x y z and intensity as 32-bit floats are read, as KITTI and nuScenes have them, and x y z alone; save others by their type and columns: numpy.save('0.npy', numpy.fromfile(FILE, '<f4').reshape(-1, 7)[:, :3])",
  ],
  [/\.(mp4|avi|mov|webm)$/i, 'a film; depth is needed, as images of 16 bits: PNG, or a ROS bag'],
];

/** So much of a file is looked into for it (bytes). */
const LOOKED_INTO = 4096;
/** By what a file begins with or holds at its beginning. */
const BY_CONTENTS: readonly [RegExp, string][] = [
  [
    /^SQLite format 3\0[^]*CREATE TABLE Node/,
    'a database of RTAB-Map, which is not read; export its images: rtabmap-export --images --poses --output out FILE',
  ],
  [/^SQLite format 3\0/, 'a database of SQLite that is no bag of ROS 2; a bag is called .db3'],
  [
    /^\s*image:\s*\S+[^]*\b(occupied_thresh|resolution):/,
    'describes a map that is finished, which holds no scans; give what it was made of: ros2 bag record /scan /odom',
  ],
  [
    /^(rosbag2_bagfile_information):/,
    'describes a bag of ROS 2 that is not here; give the whole folder, with its .db3 or .mcap',
  ],
  [
    /^\xed\xa1\xda\x01/,
    'a log of LCM, which is not read; play it (lcm-logplayer FILE) and write each scan as a line of numbers: time r1 r2 ...',
  ],
  [
    /^\$G[PNLAB][A-Z]{3},/m,
    'sentences of a satellite receiver, without scans; give the recording of the laser or the camera',
  ],
  [
    /^[^\n\0]*\b(lat(itude)?\b[^\n\0]*\b(lon(gitude)?|lng)|(lon(gitude)?|lng)\b[^\n\0]*\blat(itude)?)\b/i,
    'geographic coordinates in degrees; project them (UTM, for example) and save x y z in metres',
  ],
  [
    /^[^\n\0]*\b(acc(el)?(eration)?_?x|a_?x|gyro_?x|linear_acceleration\.x)\b/i,
    'readings of an inertial sensor, without scans; give the recording of the laser or the camera',
  ],
];

/** How lines of graphs of poses begin, whatever the file is called. */
const RELATIONS = /^(EDGE(2|3|_SE2|_SE3:QUAT)|VERTEX_SE[23]\S*)\s/;

/**
 * What a file that is not read is, and how to convert it: completes "FILE: not used: ..."; null where nothing is known.
 * @param head its first bytes, where they are known
 */
export function adviceFor(path: string, head: Uint8Array | null = null): string | null {
  const known = adviceByContents(head) ?? ADVICE.find(([name]) => name.test(path))?.[1] ?? null;
  const isOfGraph = known === null && head !== null && isGraph(head);
  return isOfGraph ? 'relations between poses, without scans; give the log or bag of the laser' : known;
}

/** The same where the beginning of a file tells; null where it does not. */
export function adviceByContents(head: Uint8Array | null): string | null {
  if (head === null || head.length === 0) return null;
  const beginning = new TextDecoder('latin1').decode(head.subarray(0, LOOKED_INTO));
  return BY_CONTENTS.find(([contents]) => contents.test(beginning))?.[1] ?? null;
}

/** Whether what is known of a text is a graph of poses alone. */
export function isGraph(head: Uint8Array) {
  const lines = new TextDecoder('latin1').decode(head).split('\n').slice(0, -1);
  const told = lines.filter((line) => line.trim() !== '' && !line.startsWith('#'));
  return told.length > 0 && told.every((line) => RELATIONS.test(line));
}

/** A note about each file, or about each series of files. */
export function unused(files: readonly ListedFile[], what: string): Note[] {
  return seriesOf(files).map((series) => {
    return { file: nameOf(series), reason: `not used: ${adviceFor(series.members[0]?.path ?? '') ?? what}` };
  });
}
