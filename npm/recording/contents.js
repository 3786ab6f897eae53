// @ts-check
/** What lies in archives and bags, as files of a recording: unpacked when it is read. */

/** @typedef {import('../recording.js').Recording} Recording */
/**
 * A file of a recording, wherever it lies.
 * @typedef {object} Content
 * @property {string} path folders separated by slashes
 * @property {number} size bytes
 * @property {() => Promise<Uint8Array>} read all of it
 * @property {(length: number) => Promise<Uint8Array>} readHead its first bytes, or all it has
 * @property {boolean} [isCloud] whether it is a cloud, whatever its name says
 * @property {Recording} [given] the recording that it is a part of, in a bag
 * @property {readonly import('../recording.js').Note[]} [losses] what could not be read of it, once it has been read
 * @property {() => Promise<import('../archive.js').ByteSource>} [open] its bytes piece by piece, where it need not be read as a whole
 * @property {Blob} [blob] as the browser has it
 * @property {string} [disk] where it lies on the disk
 * @property {boolean} [isNamed] whether it was named itself; false: the folder that it lies in was, in which no archive is opened
 */

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
