/** What lies in archives and bags, as files of a recording: unpacked when it is read. */
import type { Archive } from '../archive/archive.js';
import type { recordingsOf } from '../bag/bag_recordings.js';
import type { BagContent } from '../bag/recording.js';
import type { Content } from '../files/content.js';

export function filesInArchive(archive: Archive): Content[] {
  return archive.files.map(({ path, size }) => ({
    path,
    size,
    read: () => archive.read(path),
    readHead: (length) => archive.readHead(path, length),
  }));
}

export function filesInBags(recordings: Awaited<ReturnType<typeof recordingsOf>>): Content[] {
  return recordings.flatMap(({ files, recording }) => {
    // A bag without anything to use is still to be told of.
    const empty: BagContent = { path: recording.root, size: 0, read: async () => new Uint8Array() };
    return (files.length > 0 ? files : [empty]).map(({ path, size, read, losses = [] }) => ({
      path,
      size,
      given: recording,
      losses,
      read,
      readHead: async (length: number) => (await read()).subarray(0, length),
    }));
  });
}
