// @ts-check
/** The opener: the same recording from wherever its files come, each file used or named, and an end at any moment. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { zipSync } from 'fflate';
import { fileInMemory } from '../../npm/files/content.js';
import { openRecording } from '../../npm/recording_reader.js';
import { mcapBytes } from './bag_files.mjs';
import { cameraInfo, image, poseStamped } from './bag_messages.mjs';
import { DEPTH16, encode, RGB, tum } from './recording_files.mjs';
import { ROOM_FILES } from './support.mjs';

/** @type {Record<string, Uint8Array>} */
const SCANS = Object.fromEntries(
  Object.entries({ ...ROOM_FILES, 'truth.tum': tum(4), 'other.tum': tum(4), 'notes.md': 'words' }).map(
    ([path, text]) => [path, encode(text)],
  ),
);
/** @param {Uint8Array} bytes */
const blobOf = (bytes) => new Blob([/** @type {BlobPart} */ (bytes)]);

/** A camera with two trajectories beside it. */
function walk() {
  const topics = [
    { name: '/depth', type: 'sensor_msgs/msg/Image' },
    { name: '/info', type: 'sensor_msgs/msg/CameraInfo' },
    { name: '/truth', type: 'geometry_msgs/msg/PoseStamped' },
    { name: '/wheels', type: 'geometry_msgs/msg/PoseStamped' },
  ];
  const messages = [1, 2, 3].flatMap((sec) => {
    const [stamp, time] = [{ sec, nsec: 0 }, BigInt(sec) * 1_000_000_000n];
    const data = new Uint8Array(8);
    return [
      { topic: '/depth', time, data: image({ stamp, width: 2, height: 2, encoding: '16UC1', data }) },
      { topic: '/info', time, data: cameraInfo(stamp, 2, 2, [1, 1, 1, 1]) },
      { topic: '/truth', time, data: poseStamped(stamp, 'world', [sec, 0, 0, 0, 0, 0, 1]) },
      { topic: '/wheels', time, data: poseStamped(stamp, 'world', [0, sec, 0, 0, 0, 0, 1]) },
    ];
  });
  return mcapBytes(topics, messages);
}

test('the same recording from blobs, Files, an archive and other sources; each file is used or named', async () => {
  const entries = Object.entries(SCANS);
  const archive = { path: 'room.zip', blob: blobOf(zipSync(SCANS)) };
  const missing = { file: 'gone.ply', reason: 'could not be read' };
  for (const sources of [
    entries.map(([path, bytes]) => ({ path, blob: blobOf(bytes) })),
    entries.map(([path, bytes]) => new File([/** @type {BlobPart} */ (bytes)], path)),
    entries.map(([path, bytes]) => fileInMemory(path, bytes)),
    [archive],
  ]) {
    const recording = await openRecording(sources, { notes: [missing] });
    assert.equal(recording.kind, 'planar_scans');
    assert.deepEqual(recording.scans, Object.keys(ROOM_FILES));
    assert.deepEqual([recording.reference, recording.logs, recording.tables], [['other.tum'], [], []]);
    const named = [...recording.scans, ...recording.reference, ...recording.notes.map(({ file }) => file)];
    assert.deepEqual(named.toSorted(), ['gone.ply', ...Object.keys(SCANS)].toSorted());
    assert.deepEqual(await recording.read('0.ply'), SCANS['0.ply']);
    await assert.rejects(recording.read('9.ply'), /9\.ply: There is no such file in the recording/);
    const { trajectories, skipped } = await recording.trajectories();
    assert.deepEqual([trajectories.map(({ name }) => name), skipped], [['truth.tum', 'other.tum'], ['notes.md']]);
  }
});

test('an archive that cannot be opened is named with the remedy, and costs nothing else', async () => {
  const broken = { path: 'b.zip', blob: new Blob(['PK']) };
  const { scans, notes } = await openRecording([
    broken,
    { path: '0.ply', blob: blobOf(encode(ROOM_FILES['0.ply'] ?? '')) },
  ]);
  assert.deepEqual(scans, ['0.ply']);
  assert.match(notes[0]?.reason ?? '', /^not used: .+\. .+/);
  assert.ok(notes[0]?.is_loss);
});

test('other topics of a bag: where only the reference changes, the frames are the same files', async () => {
  const bag = { path: 'walk.mcap', blob: blobOf(walk()) };
  const first = await openRecording([bag, { path: 'truth.tum', blob: blobOf(encode(tum(3, 1))) }]);
  assert.deepEqual([first.depth_frames.length, first.reference], [3, ['truth.tum']]);
  const frame = first.files.get(first.depth_frames[0]?.depth ?? '');
  const other = await first.choose({ reference: '/wheels' });
  assert.equal(other.bags[0]?.choice.reference, '/wheels');
  assert.equal(other.files.get(other.depth_frames[0]?.depth ?? ''), frame);
  assert.ok(other.files.has('truth.tum'));
  await assert.rejects(first.choose({ depth: '/none' }), /\/none/);

  const beside = await openRecording([{ path: 'camera-intrinsics.txt', blob: blobOf(encode('30 30 16 12\n')) }]);
  assert.equal(beside.kind, 'nothing');
  const together = await first.with(beside);
  assert.deepEqual([together.depth_frames.length, together.intrinsics], [3, 'camera-intrinsics.txt']);
});

test('aborted at any moment it rejects with the reason of the signal', async () => {
  const images = Object.fromEntries(
    [1, 2, 3, 4, 5, 6].flatMap((i) => [
      [`rgb/${i}.png`, RGB],
      [`depth/${i}.png`, DEPTH16],
    ]),
  );
  const contents = { ...images, 'walk.mcap': walk(), 'more.zip': zipSync(SCANS), 'gt.tum': encode(tum(6)) };
  /** @param {number} moment of which reading it is aborted @returns {Promise<{ numRead: number, reason: unknown }>} */
  const openUntil = async (moment) => {
    const aborting = new AbortController();
    let numRead = 0;
    const noted = (/** @type {Uint8Array} */ bytes) => {
      numRead += 1;
      if (numRead === moment) aborting.abort();
      return bytes;
    };
    const sources = Object.entries(contents).map(([path, bytes]) => ({
      path,
      size: bytes.length,
      read: async () => noted(bytes.slice()),
      readHead: async (/** @type {number} */ length) => noted(bytes.slice(0, length)),
      open: async () => ({
        size: bytes.length,
        read: async (/** @type {number} */ start, /** @type {number} */ end) => noted(bytes.subarray(start, end)),
      }),
    }));
    const reason = await openRecording(sources, { signal: aborting.signal }).then(
      () => null,
      (error) => error.name,
    );
    return { numRead, reason };
  };
  const whole = await openUntil(Infinity);
  assert.equal(whole.reason, null);
  assert.ok(whole.numRead >= 20, `${whole.numRead}`);
  for (let moment = 1; moment <= whole.numRead; moment += 1) {
    assert.deepEqual((await openUntil(moment)).reason, 'AbortError', `reading ${moment} of ${whole.numRead}`);
  }
});
