/** The two images of the selected frame, fetched and decoded on selection; the last selection takes precedence. */
import type { ReactiveController, ReactiveControllerHost } from 'lit';
import type { Content } from '../../../package/recording_reader.js';
import { pictureOf } from '../datasets/bitmap.js';
import type { DepthColors } from '../engine/spatial-protocol.js';
import { depthPicture } from './depth-picture.js';
import { type FrameImages, NO_IMAGES } from './frame-panel.js';

/** While the slider is drawn, frames rush by: only one that stays this long is decoded. */
const SETTLE_MS = 60;

export class FrameImageLoader implements ReactiveController {
  images: FrameImages = NO_IMAGES;
  /** The frame they belong to. */
  frame: number | null = null;
  #host: ReactiveControllerHost;
  #picture: (file: Content) => Promise<DepthColors>;
  #wanted: unknown = null;
  #timer: ReturnType<typeof setTimeout> | undefined;
  #url = '';

  constructor(host: ReactiveControllerHost, picture: (file: Content) => Promise<DepthColors>) {
    this.#host = host;
    this.#picture = picture;
    host.addController(this);
  }

  hostDisconnected(): void {
    clearTimeout(this.#timer);
    URL.revokeObjectURL(this.#url);
    this.#url = '';
    this.#wanted = null;
    this.images = NO_IMAGES;
  }

  /** `depth_scale`: raw values to a metre. */
  want(frame: number | null, depth: Content | null, color: Content | null, depth_scale: number): void {
    const key = depth ?? color;
    if (key === this.#wanted) return;
    this.#wanted = key;
    clearTimeout(this.#timer);
    if (!key || frame === null) {
      this.#show(null, NO_IMAGES);
      return;
    }
    this.#timer = setTimeout(() => this.#load(key, frame, depth, color, depth_scale), SETTLE_MS);
  }

  async #load(
    key: Content,
    frame: number,
    depth: Content | null,
    color: Content | null,
    depth_scale: number,
  ): Promise<void> {
    let url = '';
    const loadColor = async (): Promise<HTMLImageElement | null> => {
      if (!color) return null;
      url = URL.createObjectURL(await pictureOf(color));
      const image = new Image();
      image.src = url;
      await image.decode();
      return image;
    };
    const [colorImage, depthColors] = await Promise.allSettled([loadColor(), depth ? this.#picture(depth) : null]);
    if (this.#wanted !== key) {
      URL.revokeObjectURL(url);
      return;
    }
    URL.revokeObjectURL(this.#url);
    this.#url = url;
    const found = depthColors.status === 'fulfilled' ? depthColors.value : null;
    this.#show(frame, {
      color: colorImage.status === 'fulfilled' ? colorImage.value : null,
      depth: found && depthPicture(found, depth_scale),
      problem: depthColors.status === 'rejected' ? String((depthColors.reason as Error).message) : '',
    });
  }

  #show(frame: number | null, images: FrameImages): void {
    this.frame = frame;
    this.images = images;
    this.#host.requestUpdate();
  }
}
