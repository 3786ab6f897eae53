// @ts-check
/** What lies in archives and bags, as files of a recording: unpacked when it is read. */

/** @typedef {import('../recording_reader.js').Content} Content */

/**
 * A file whose bytes are in memory; each reader has a copy of its own.
 * @param {string} path
 * @param {Uint8Array} bytes
 * @returns {Content}
 */
export function fileInMemory(path, bytes) {
  return {
    path,
    size: bytes.length,
    read: async () => bytes.slice(),
    readHead: async (length) => bytes.slice(0, length),
  };
}

/**
 * @param {import('../archive.js').Archive} archive
 * @returns {Content[]}
 */
export function filesInArchive(archive) {
  return archive.files.map(({ path, size }) => ({
    path,
    size,
    read: () => archive.read(path),
    readHead: (length) => archive.readHead(path, length),
  }));
}

/**
 * @param {Awaited<ReturnType<typeof import('../bag/bag_recordings.js').recordingsOf>>} recordings
 * @returns {Content[]}
 */
export function filesInBags(recordings) {
  return recordings.flatMap(({ files, recording }) => {
    // A bag without anything to use is still to be told of.
    /** @type {import('../bag/recording.js').BagContent} */
    const empty = { path: recording.root, size: 0, read: async () => new Uint8Array() };
    return (files.length > 0 ? files : [empty]).map(({ path, size, read, losses = [] }) => ({
      path,
      size,
      given: recording,
      losses,
      read,
      readHead: async (/** @type {number} */ length) => (await read()).subarray(0, length),
    }));
  });
}
