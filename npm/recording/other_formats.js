// @ts-check
/** Formats that are not read, and the one line that helps: which program converts them, with the command. */

/** By how a name ends. @type {readonly [RegExp, string][]} */
const ADVICE = [
  [/\.(tar\.xz|txz)$/i, 'an archive packed by xz, which is not opened; unpack it (tar xf FILE) and give the folder'],
  [/\.7z$/i, 'an archive of 7-Zip, which is not opened; unpack it (7z x FILE) and give the folder'],
  [/\.rar$/i, 'an archive of RAR, which is not opened; unpack it (unrar x FILE) and give the folder'],
  [/\.xz$/i, 'packed by xz; unpack it (unxz FILE) and give what comes out'],
  [
    /\.db3-(wal|shm|journal)$/i,
    "belongs to a bag that was not closed; merge it (sqlite3 FILE.db3 'PRAGMA wal_checkpoint(TRUNCATE)') and give the .db3",
  ],
  [/\.(laz|copc)$/i, 'a LAZ cloud, which is not read; convert it: pdal translate FILE out.ply'],
  [
    /\.e57$/i,
    'an E57 cloud, which is not read; convert it: CloudCompare -SILENT -O FILE -C_EXPORT_FMT PLY -SAVE_CLOUDS',
  ],
  [/\.(obj|stl|off|gltf|glb)$/i, 'a mesh, which is not read; save its vertices as PLY (MeshLab or CloudCompare)'],
  [/\.rawlog$/i, 'a rawlog of MRPT, which is not read; export its scans: rawlog-edit --export-2d-scans-txt -i FILE'],
  [
    /\.(h5|hdf5)$/i,
    "HDF5, which is not read; save the array as text: numpy.savetxt('ranges.csv', array, delimiter=',')",
  ],
  [/\.bag\.active$/i, 'a bag that its recorder did not close; mend it: rosbag reindex FILE'],
  [/\.(mp4|avi|mov|mkv|webm)$/i, 'a film; depth is needed, as images of 16 bits: PNG, or a ROS bag'],
];

/** What a Git LFS pointer begins with. */
const LFS_POINTER = 'version https://git-lfs.github.com/spec/v1';

/**
 * What a file that is not read is, and how to convert it: completes "FILE: not used: ..."; null where nothing is known.
 * @param {string} path
 * @param {Uint8Array | null} [head] its first bytes, where they are known
 * @returns {string | null}
 */
export function adviceFor(path, head = null) {
  if (head && new TextDecoder('latin1').decode(head.subarray(0, LFS_POINTER.length)) === LFS_POINTER) {
    return 'a pointer of Git LFS in place of the file; fetch the file: git lfs pull';
  }
  return ADVICE.find(([name]) => name.test(path))?.[1] ?? null;
}
