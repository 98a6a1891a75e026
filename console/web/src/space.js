// A scene in the motion-capture frame (m, z up) that is turned with the mouse, a finger or the arrow keys.
import * as three from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

// A word that always faces the viewer.
function label(text) {
  const canvas = document.createElement("canvas"), context = canvas.getContext("2d");
  canvas.width = 256;
  canvas.height = 64;
  context.font = "600 34px system-ui, sans-serif";
  context.textAlign = "center";
  context.fillStyle = "#dfe8f5";
  context.fillText(text, 128, 42);
  const sprite = new three.Sprite(new three.SpriteMaterial(
    { map: new three.CanvasTexture(canvas), depthTest: false, transparent: true, sizeAttenuation: false }));
  sprite.scale.set(0.13, 0.0325, 1);
  return sprite;
}

const kTeal = 0x5fe0c8, kAmber = 0xf5b93c, kGrey = 0x8894a6;

export class Space {
  // near: a fabric fills the view; else the whole rig does.
  constructor(box, near = false) {
    this.box = box;
    const target = near ? new three.Vector3(0, 0, -0.16) : new three.Vector3(0.3, -0.36, 0);
    this.scene = new three.Scene();
    this.camera = new three.PerspectiveCamera(38, 1, 0.01, 30);
    this.camera.up.set(0, 0, 1);
    this.camera.position.set(...(near ? [-0.3, -0.78, 0.06] : [-1.35, -2.15, 1.0]));
    try {
      this.renderer = new three.WebGLRenderer({ antialias: true, alpha: true });
    } catch {
      box.textContent = "this browser draws nothing in three dimensions";  // all else of the page works
    }
    this.camera.lookAt(target);
    if (this.renderer) {
      this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
      box.append(this.renderer.domElement);
      this.controls = new OrbitControls(this.camera, this.renderer.domElement);
      this.controls.target.copy(target);
      this.controls.listenToKeyEvents(box);
      this.controls.addEventListener("change", () => this.draw());
    }
    this.scene.add(new three.HemisphereLight(0xffffff, 0x334455, 2.2));
    const sun = new three.DirectionalLight(0xffffff, 1.6);
    sun.position.set(0.6, -1.2, 1.4);
    this.scene.add(sun);
    const floor = new three.GridHelper(2, 20, 0x46536a, 0x2a3446);
    floor.rotation.x = Math.PI / 2;
    floor.position.z = -0.42;
    this.scene.add(floor);
    this.dots = new three.Group();
    this.armGroup = new three.Group();
    this.deviceGroup = new three.Group();
    this.scene.add(this.dots, this.armGroup, this.deviceGroup);
    new ResizeObserver(() => this.fit()).observe(box);
    this.fit();
  }

  fit() {
    const width = this.box.clientWidth, height = this.box.clientHeight;
    if (!width || !height || !this.renderer) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  draw() {
    if (this.pending || !this.renderer) return;
    this.pending = true;
    requestAnimationFrame(() => { this.pending = false; this.renderer.render(this.scene, this.camera); });
  }

  // Markers by name; the held corners stand out. What moved by less than half a millimetre is not drawn anew.
  setMarkers(markers) {
    const drawn = JSON.stringify(markers.map((m) => [m.name, ...m.at.map((v) => Math.round(2e3 * v))]));
    if (drawn === this.drawnMarkers) return;
    this.drawnMarkers = drawn;
    while (this.dots.children.length < markers.length)
      this.dots.add(
        new three.Mesh(new three.SphereGeometry(1, 20, 14), new three.MeshStandardMaterial({ roughness: 0.4 })));
    this.dots.children.forEach((dot, i) => {
      dot.visible = i < markers.length;
      if (!dot.visible) return;
      const corner = markers[i].name === "left" || markers[i].name === "right";
      dot.position.set(...markers[i].at);
      dot.scale.setScalar(corner ? 0.016 : 0.006);
      dot.material.color.setHex(corner ? kTeal : kGrey);
    });
    const corners =
      markers.filter((m) => m.name === "left" || m.name === "right").map((m) => new three.Vector3(...m.at));
    if (!this.edge) {
      this.edge = new three.Line(
        new three.BufferGeometry(), new three.LineBasicMaterial({ color: kTeal, transparent: true, opacity: 0.6 }));
      this.scene.add(this.edge);
    }
    this.words ??= Object.fromEntries(["left", "right"].map((name) => {
      const word = label(name);
      this.scene.add(word);
      return [name, word];
    }));
    for (const [name, word] of Object.entries(this.words)) {
      const corner = markers.find((m) => m.name === name);
      word.visible = Boolean(corner);
      if (corner) word.position.set(corner.at[0], corner.at[1], corner.at[2] + 0.045);
    }
    this.edge.visible = corners.length === 2;
    if (this.edge.visible) this.edge.geometry.setFromPoints(corners);
    this.draw();
  }

  // The arm's joints from base to tool.
  setArm(points, moving, armed) {
    const drawn = JSON.stringify([moving, armed, points.map((p) => p.map((v) => Math.round(2e3 * v)))]);
    if (drawn === this.drawnArm) return;
    this.drawnArm = drawn;
    const wanted = Math.max(0, points.length - 1);
    while (this.armGroup.children.length < 2 * wanted) {
      const material = new three.MeshStandardMaterial({ roughness: 0.5, metalness: 0.2 });
      this.armGroup.add(
        new three.Mesh(new three.CylinderGeometry(0.024, 0.03, 1, 18), material),
        new three.Mesh(new three.SphereGeometry(0.034, 20, 14), material));
    }
    const colour = moving ? kAmber : armed ? kTeal : 0xb9c3d2;
    this.armGroup.children.forEach((part, i) => {
      const k = i >> 1;
      part.visible = k < wanted;
      if (!part.visible) return;
      part.material.color.setHex(colour);
      const a = new three.Vector3(...points[k]), b = new three.Vector3(...points[k + 1]);
      if (i % 2) { part.position.copy(b); return; }
      const along = b.clone().sub(a);
      part.visible = along.length() > 1e-4;
      part.position.copy(a).addScaledVector(along, 0.5);
      part.scale.set(1, Math.max(along.length(), 1e-4), 1);
      part.quaternion.setFromUnitVectors(new three.Vector3(0, 1, 0), along.normalize());
    });
    this.draw();
  }

  // Camera and projector as pyramids, from their 3×4 matrices.
  setDevices(devices) {
    this.deviceGroup.clear();
    for (const { name, projection, width_px: width, height_px: height, colour } of devices) {
      const m = new three.Matrix3().set(...projection.flatMap((row) => row.slice(0, 3)));
      const inverse = m.clone().invert(), p4 = new three.Vector3(...projection.map((row) => row[3]));
      const centre = p4.clone().applyMatrix3(inverse).negate();
      const sign = Math.sign(m.determinant()) || 1;
      const corner = ([u, v]) =>
        new three.Vector3(u, v, 1).applyMatrix3(inverse).multiplyScalar(sign).normalize().multiplyScalar(0.22).add(
          centre);
      const ends = [[0, 0], [width, 0], [width, height], [0, height]].map(corner), lines = [];
      ends.forEach((end, i) => lines.push(centre, end, end, ends[(i + 1) % 4]));
      const word = label(name);
      word.position.copy(centre).add(new three.Vector3(0, 0, 0.07));
      this.deviceGroup.add(
        word,
        new three.LineSegments(
          new three.BufferGeometry().setFromPoints(lines), new three.LineBasicMaterial({ color: colour })));
    }
    this.draw();
  }

  // A sheet of triangles whose vertices setSheet then moves.
  makeSheet(triangles, vertices) {
    if (this.sheet) this.scene.remove(this.sheet, this.wires);
    const geometry = new three.BufferGeometry();
    geometry.setAttribute("position", new three.BufferAttribute(new Float32Array(3 * vertices), 3));
    geometry.setIndex(triangles.flat());
    this.sheet = new three.Mesh(
      geometry,
      new three.MeshStandardMaterial(
        { color: 0xd9c7a8, roughness: 0.85, side: three.DoubleSide, polygonOffset: true, polygonOffsetFactor: 1 }));
    this.wires = new three.Mesh(
      geometry, new three.MeshBasicMaterial({ color: 0x6d5f45, wireframe: true, transparent: true, opacity: 0.22 }));
    this.sheet.frustumCulled = this.wires.frustumCulled = false;
    this.scene.add(this.sheet, this.wires);
  }

  setSheet(positions) {
    const attribute = this.sheet.geometry.getAttribute("position");
    attribute.array.set(positions);
    attribute.needsUpdate = true;
    this.sheet.geometry.computeVertexNormals();
    this.draw();
  }

  hideSheet() {
    if (this.sheet) this.scene.remove(this.sheet, this.wires);
    this.sheet = this.wires = null;
    this.draw();
  }
}
