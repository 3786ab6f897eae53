/** The built-in sample of trajectories: the corridor's ground truth, and what three strategies made of its scans. */
import { fetchOk } from './fetch-ok.js';
import type { NamedFile } from './gather.js';

const urls = import.meta.glob<string>(['../../samples/trajectories/*.tum', '../../samples/corridor/truth.tum'], {
  query: '?url',
  import: 'default',
  eager: true,
});

export async function fetchTrajectories(): Promise<NamedFile[]> {
  const fetched = Object.entries(urls).map(async ([path, url]) => {
    const name = path.slice(path.lastIndexOf('/') + 1);
    return { name, file: new File([await (await fetchOk(url)).blob()], name) };
  });
  return Promise.all(fetched);
}
