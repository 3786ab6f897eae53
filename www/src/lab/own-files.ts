/** Poses of the user's own ICP, from a file to the session. */
import type { NamedFile } from '../datasets/gather.js';
import { messageOf } from '../engine/message-of.js';
import { baseName } from '../views/format.js';
import { isPosesName } from './clouds.js';
import type { LabSession } from './session.js';

/** Whether they were added beside the engine's; if not, the reason is reported. */
export async function takeOwn(session: LabSession, { name, file }: NamedFile): Promise<boolean> {
  const short = baseName(name);
  if (!isPosesName(name)) {
    session.report(
      `${short} is not a cloud`,
      'Drop PLY or PCD files, or the poses of your own ICP. Depth images, logs and bags: open them under Map, and choose Look inside at a frame',
    );
    return false;
  }
  if (!session.trace) {
    session.report('There are no clouds yet to follow your poses on', 'Drop two clouds first');
    return false;
  }
  const { read_own_poses } = await import('../../../package/lab/own_poses.js');
  try {
    await session.addOwn(short, read_own_poses(new Uint8Array(await file.arrayBuffer()), short));
    return true;
  } catch (error) {
    // It says what would be right.
    session.report(`Poses of ${messageOf(error).replace(/\.$/, '')}`);
    return false;
  }
}
