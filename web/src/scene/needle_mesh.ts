/** The needle where it stands, glassy, so that the tissue under it is seen. */

import { BackSide, FrontSide, Group, Mesh, MeshPhongMaterial, type BufferGeometry } from "three";

import type { Quaternion, Vector } from "../model/wire";
import { needleGeometry, type NeedleShape } from "./needle_geometry";

const LENGTH_MM = 1.7;

/** Steel that is clear where it is looked at straight and dense at the rim, so that outline and tissue are both seen. */
function glass(side: typeof FrontSide | typeof BackSide, opacity: number): MeshPhongMaterial {
  const material = new MeshPhongMaterial({
    color: 0xb4c3d2,
    transparent: true,
    opacity,
    depthWrite: false,
    side,
  });
  material.onBeforeCompile = (shader) => {
    shader.fragmentShader = shader.fragmentShader.replace(
      "#include <opaque_fragment>",
      `float facing = abs(dot(normalize(normal), normalize(vViewPosition)));
       diffuseColor.a *= mix(1.0, 0.3, smoothstep(0.0, 0.75, facing));
       #include <opaque_fragment>`,
    );
  };
  return material;
}

export class NeedleMesh {
  readonly group = new Group();
  readonly front: Mesh<BufferGeometry, MeshPhongMaterial>;
  private readonly back: Mesh<BufferGeometry, MeshPhongMaterial>;
  private shapeKey = "";

  constructor() {
    this.back = new Mesh(undefined, glass(BackSide, 0.45));
    this.front = new Mesh(undefined, glass(FrontSide, 0.85));
    this.back.renderOrder = 2;
    this.front.renderOrder = 3;
    this.group.add(this.back, this.front);
  }

  shape(shape: NeedleShape): void {
    const key = JSON.stringify(shape);
    if (key === this.shapeKey) return;
    this.shapeKey = key;
    this.front.geometry.dispose();
    this.front.geometry = this.back.geometry = needleGeometry(shape, LENGTH_MM);
  }

  place(tipMm: Vector, orientation: Quaternion): void {
    this.group.position.set(...tipMm);
    this.group.quaternion.set(...orientation);
  }
}
