/** What the menu “Open” offers. */
import type { MenuItem } from './menu.js';

export const OPEN_ITEMS: readonly MenuItem[] = [
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
  { id: 'clear', label: 'Remove all', detail: 'the next files start a new data set' },
];
