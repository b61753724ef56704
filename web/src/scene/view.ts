/** Camera, lights and canvas; draws when something changed and not otherwise. */

import {
  DirectionalLight,
  HemisphereLight,
  PerspectiveCamera,
  Raycaster,
  Scene,
  Vector2,
  Vector3,
  WebGLRenderer,
  type Object3D,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

import { Resolution } from "./resolution";

const TARGET = new Vector3(0, 0, 0.1);
const HOME = new Vector3(0.75, -2.5, 1.75);
/** Half of the width and height, in mm at the target, that must stay in view. */
const HALF_WIDTH_MM = 1.62;
const HALF_HEIGHT_MM = 1.2;
const FIELD_OF_VIEW_DEG = 32;

export class View {
  readonly scene = new Scene();
  readonly camera = new PerspectiveCamera(FIELD_OF_VIEW_DEG, 1, 0.05, 50);
  readonly renderer: WebGLRenderer;
  readonly controls: OrbitControls;
  /** Frames drawn so far. */
  frames = 0;
  private readonly resolution = new Resolution(() => this.draw());
  private pending = false;
  private moved = false;
  private readonly raycaster = new Raycaster();

  constructor(
    canvas: HTMLCanvasElement,
    private readonly afterFrame: () => void,
  ) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.camera.up.set(0, 0, 1);
    const key = new DirectionalLight(0xffffff, 1.9);
    key.position.set(-2.2, 0.6, 2.2);
    const fill = new DirectionalLight(0xffffff, 0.5);
    fill.position.set(2, -2, 1);
    this.scene.add(new HemisphereLight(0xffffff, 0xa09890, 1.5), key, fill);
    this.controls = new OrbitControls(this.camera, canvas);
    Object.assign(this.controls, { minDistance: 0.8, maxDistance: 12, enablePan: false });
    this.controls.addEventListener("change", () => this.requestFrame());
    this.controls.addEventListener("start", () => (this.moved = true));
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement ?? canvas);
    this.home();
  }

  /** The camera where it began: the whole patch in view, whatever the shape of the window. */
  home(): void {
    this.moved = false;
    const tan = Math.tan((FIELD_OF_VIEW_DEG * Math.PI) / 360);
    const distance = Math.max(HALF_HEIGHT_MM, HALF_WIDTH_MM / this.camera.aspect) / tan;
    this.controls.target.copy(TARGET);
    this.camera.position.copy(HOME).setLength(distance).add(TARGET);
    this.controls.update();
    this.requestFrame();
  }

  /** Turns the camera about the patch, degrees. */
  orbit(azimuthDeg: number, elevationDeg: number): void {
    this.moved = true;
    const offset = this.camera.position.clone().sub(this.controls.target);
    const { x, y, z } = offset;
    const azimuth = Math.atan2(y, x) + (azimuthDeg * Math.PI) / 180;
    const elevation = Math.asin(z / offset.length()) + (elevationDeg * Math.PI) / 180;
    const bounded = Math.min(1.55, Math.max(-1.55, elevation));
    const [across, size] = [Math.cos(bounded), offset.length()];
    offset.set(across * Math.cos(azimuth), across * Math.sin(azimuth), Math.sin(bounded));
    this.camera.position.copy(this.controls.target).addScaledVector(offset, size);
    this.controls.update();
    this.requestFrame();
  }

  zoom(factor: number): void {
    this.moved = true;
    const offset = this.camera.position.clone().sub(this.controls.target);
    const { minDistance, maxDistance } = this.controls;
    offset.setLength(Math.min(maxDistance, Math.max(minDistance, offset.length() * factor)));
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
    this.requestFrame();
  }

  requestFrame(): void {
    if (this.pending) return;
    this.pending = true;
    requestAnimationFrame((now) => {
      this.pending = false;
      this.render(this.resolution.next(now));
    });
  }

  /** Draws at once and finely: what a picture of the canvas needs right before it is taken. */
  draw(): void {
    this.render(1);
  }

  /** Where a ray through a point of the window first meets one of the objects. */
  hit(clientX: number, clientY: number, objects: readonly Object3D[]): Vector3 | undefined {
    const box = this.renderer.domElement.getBoundingClientRect();
    const x = ((clientX - box.left) / box.width) * 2 - 1;
    const y = 1 - ((clientY - box.top) / box.height) * 2;
    this.raycaster.setFromCamera(new Vector2(x, y), this.camera);
    return this.raycaster.intersectObjects([...objects], false)[0]?.point;
  }

  /** Where a point of the scene is on the canvas, CSS pixels. */
  onCanvas(point: Vector3): { x: number; y: number } {
    const box = this.renderer.domElement;
    const { x, y } = point.clone().project(this.camera);
    return { x: ((x + 1) / 2) * box.clientWidth, y: ((1 - y) / 2) * box.clientHeight };
  }

  private render(share: number): void {
    const ratio = share * Math.min(2, devicePixelRatio);
    if (ratio !== this.renderer.getPixelRatio()) this.renderer.setPixelRatio(ratio);
    this.renderer.render(this.scene, this.camera);
    this.frames++;
    this.afterFrame();
  }

  private resize(): void {
    const stage = this.renderer.domElement.parentElement;
    if (!stage || stage.clientWidth === 0 || stage.clientHeight === 0) return;
    this.renderer.setSize(stage.clientWidth, stage.clientHeight);
    this.camera.aspect = stage.clientWidth / stage.clientHeight;
    this.camera.updateProjectionMatrix();
    if (this.moved) this.requestFrame();
    else this.home();
  }
}
