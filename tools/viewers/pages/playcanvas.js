// PlayCanvas' engine, as SuperSplat has it, with all settings of the engine's own.

import * as pc from 'playcanvas';
import { FAR, NEAR, projectionMatrix, worldMatrix } from './camera.js';

// When sorting has come to rest: so many ms without an order from the worker. The frame after
// an order draws it.
const REST = 200;
// A camera that has hardly turned is not sorted for: so many ms are waited to see.
const UNTURNED = 1000;

export async function open(canvas, url, [width, height], matrix) {
  const app = new pc.Application(canvas, { graphicsDeviceOptions: { antialias: false, preserveDrawingBuffer: true } });
  app.setCanvasFillMode(pc.FILLMODE_NONE, width, height);
  app.setCanvasResolution(pc.RESOLUTION_FIXED, width, height);
  app.graphicsDevice.maxPixelRatio = 1;
  app.autoRender = true;
  app.start();
  const container = url.endsWith('.glb') || url.endsWith('.gltf');
  const asset = new pc.Asset('scene', container ? 'container' : 'gsplat', { url, filename: url.split('/').pop() });
  app.assets.add(asset);
  await new Promise((resolve, reject) => {
    asset.ready(resolve);
    asset.once('error', (error) => reject(new Error(String(error))));
    app.assets.load(asset);
  });
  let sorted = 0;
  app.scene.on('gsplat:sorted', () => { sorted = performance.now(); });
  const entity = container ? asset.resource.instantiateRenderEntity() : new pc.Entity('scene');
  if (!container) entity.addComponent('gsplat', { asset });
  const root = new pc.Entity('frame');
  place(root, matrix);
  root.addChild(entity);
  app.root.addChild(root);
  const eye = new pc.Entity('camera');
  let projection = new pc.Mat4().data;
  eye.addComponent('camera', {
    clearColor: new pc.Color(0, 0, 0, 1),
    nearClip: NEAR,
    farClip: FAR,
    gammaCorrection: pc.GAMMA_SRGB,
    toneMapping: pc.TONEMAP_NONE,
  });
  eye.camera.calculateProjection = (mat) => { mat.data.set(projection); };
  app.root.addChild(eye);
  const frame = () => new Promise((resolve) => { app.once('frameend', resolve); });
  // Not before the first.
  const rest = async () => {
    while (sorted === 0 || performance.now() - sorted < REST) await frame();
  };
  return async (view) => {
    // The worker is asked once when the camera turns, and not heard while it is at work.
    await rest();
    projection = projectionMatrix(view);
    place(eye, worldMatrix(view));
    const moved = performance.now();
    while (sorted < moved && performance.now() - moved < UNTURNED) await frame();
    await rest();
    await frame();
  };
}

function place(entity, columns) {
  const matrix = new pc.Mat4();
  matrix.data.set(columns);
  entity.setLocalPosition(matrix.getTranslation());
  entity.setLocalRotation(new pc.Quat().setFromMat4(matrix));
}
