/** What the menu “Open” offers. */
import type { MenuItem } from '../components/menu.js';

const OPEN_ITEMS: readonly MenuItem[] = [
  {
    id: 'files',
    label: 'Files…',
    detail: 'scans, depth images, clouds, a ROS bag, a zip; and a trajectory to compare with',
  },
  { id: 'folder', label: 'Folder…', detail: 'including its subfolders' },
  { id: 'sample', label: 'The sample', detail: 'ten scans of a corridor, with ground truth' },
  ...(import.meta.env.MODE === 'standalone' || import.meta.env.MODE === 'module'
    ? []
    : [{ id: 'apartment', label: 'An apartment', detail: 'depth images of several rooms, with ground truth' }]),
  { id: 'view:live', label: 'A robot, live…', detail: 'by Foxglove bridge or rosbridge' },
  { id: 'clear', label: 'Remove all', detail: 'the next files start a new data set' },
];

/** `src`: what the host page opens; it is a way back to that from files of one's own. */
export function openItems(src: string): readonly MenuItem[] {
  if (src === '' || src === 'sample') return OPEN_ITEMS;
  return [...OPEN_ITEMS, { id: 'page', label: 'The data of this page', detail: 'as it was opened first' }];
}
