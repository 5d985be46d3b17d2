// A converted map to walk through: loads the glTF file with its lightmaps, and moves a capsule through its triangles.
import * as THREE from "three";
import { GLTFLoader } from "./three/examples/jsm/loaders/GLTFLoader.js";
import { Capsule } from "./three/examples/jsm/math/Capsule.js";
import { Octree } from "./three/examples/jsm/math/Octree.js";
import { steer } from "./walk-input.js";

// The engine's player in metres (1/32 of its units) and seconds.
const RADIUS = 0.4, HEIGHT = 1.75, EYE = 1.6, STEP = 0.6, SPEED = 8, GRAVITY = 25, JUMP = 8.4;
// Who is so far below the start has left the map.
const FALLEN = 100;
// What opens, moves or vanishes in the game must not stand in the way here.
const PASSABLE = /^(func_(door|plat|bobbing|train|button)|trigger_)/;

/** `MOZ_lightmap`: the baked light of a material, which three.js does not read by itself. */
function lightmaps(parser) {
  return {
    name: "MOZ_lightmap",
    extendMaterialParams(index, parameters) {
      const light = parser.json.materials[index].extensions?.MOZ_lightmap;
      if (!light) return Promise.resolve();
      parameters.lightMapIntensity = light.intensity ?? 1;
      return parser.assignTexture(parameters, "lightMap", light, THREE.SRGBColorSpace);
    },
  };
}

function load(file, onProgress) {
  const loader = new GLTFLoader();
  loader.register(lightmaps);
  return loader.loadAsync(file, onProgress);
}

/** The triangles that stop a walker: of all that is not sky, liquid or a moving part. */
function obstacles(scene) {
  const solid = new THREE.Group();
  scene.updateMatrixWorld(true);
  scene.traverse((object) => {
    if (!object.isMesh) return;
    let owner = object;
    while (owner && !owner.userData.classname) owner = owner.parent;
    const { class: kind = "" } = object.material.userData.material ?? {};
    const passable = PASSABLE.test(owner?.userData.classname ?? "") || /sky|liquid|water|fog/i.test(`${kind} ${object.material.name}`);
    if (passable) return;
    const copy = new THREE.Mesh(object.geometry);
    copy.applyMatrix4(object.matrixWorld);
    solid.add(copy);
  });
  return new Octree().fromGraphNode(solid);
}

/** A walker: a capsule, its fall, and how it moves. */
class Walker {
  constructor(octree, start, yaw) {
    Object.assign(this, { octree, start, startYaw: yaw, fly: false });
    this.capsule = new Capsule();
    this.reset();
  }

  reset() {
    const { x, y, z } = this.start;
    this.capsule.set(new THREE.Vector3(x, y - EYE + RADIUS, z), new THREE.Vector3(x, y - EYE + HEIGHT - RADIUS, z), RADIUS);
    Object.assign(this, { yaw: this.startYaw, pitch: 0, fall: 0, stands: false });
  }

  /** Moves by `way`, pushed out of what it meets; returns the direction of the push. */
  push(way) {
    this.capsule.translate(way);
    const hit = this.octree.capsuleIntersect(this.capsule);
    if (hit) this.capsule.translate(hit.normal.clone().multiplyScalar(hit.depth));
    return hit && hit.normal;
  }

  /** One short step of time; `wish` is the direction in the walker's own axes, of length 1 at most. */
  step(seconds, wish, jump) {
    const turn = new THREE.Euler(this.fly ? this.pitch : 0, this.yaw, 0, "YXZ");
    const way = new THREE.Vector3(wish.right, 0, -wish.forward).applyEuler(turn).multiplyScalar(SPEED * seconds);
    if (this.fly) {
      this.capsule.translate(way);
      return;
    }
    const before = this.capsule.clone();
    const wall = this.push(way);
    if (wall && Math.abs(wall.y) < 0.7 && this.stands) {
      const slid = this.capsule.clone();
      this.capsule.copy(before).translate(new THREE.Vector3(0, STEP, 0).add(way));
      if (this.octree.capsuleIntersect(this.capsule)) this.capsule.copy(slid);
      else this.push(new THREE.Vector3(0, -STEP, 0));
    }
    this.fall = this.stands && jump ? JUMP : Math.max(this.fall - GRAVITY * seconds, -40);
    const floor = this.push(new THREE.Vector3(0, this.fall * seconds, 0));
    this.stands = Boolean(floor && floor.y > 0.5);
    if (floor && (this.stands || this.fall > 0)) this.fall = Math.min(this.fall, 0) * (this.stands ? 0 : 1);
    if (this.capsule.start.y < this.start.y - FALLEN) this.reset();
  }

  /** Places the camera at the eye. */
  look(camera) {
    camera.position.copy(this.capsule.start);
    camera.position.y += EYE - RADIUS;
    camera.rotation.set(this.pitch, this.yaw, 0, "YXZ");
  }
}

/** The camera of a spawn point: position and yaw. */
function spawn(gltf, node) {
  const camera = gltf.cameras.find((c) => c.name === `${node}_camera` || c.parent?.name === `${node}_camera`) ?? gltf.cameras[0];
  if (!camera) return { position: new THREE.Vector3(), yaw: 0 };
  camera.updateWorldMatrix(true, false);
  const turn = new THREE.Euler().setFromQuaternion(camera.getWorldQuaternion(new THREE.Quaternion()), "YXZ");
  return { position: camera.getWorldPosition(new THREE.Vector3()), yaw: turn.y };
}

export async function begin({ file, bytes, start }) {
  const [canvas, cover, progress, message] =
    ["walk-canvas", "walk-cover", "walk-progress", "walk-message"].map((id) => document.getElementById(id));
  progress.hidden = false;
  message.textContent = "Loading the map";
  const gltf = await load(file, ({ loaded }) => {
    progress.value = loaded / bytes;
    message.textContent = `Loading the map: ${(loaded / 1e6).toFixed(1)} of ${(bytes / 1e6).toFixed(1)} MB`;
  });
  canvas.hidden = false;
  const renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
  const camera = new THREE.PerspectiveCamera(70, 1, 0.05, 4000);
  const { position, yaw } = spawn(gltf, start);
  const walker = new Walker(obstacles(gltf.scene), position, yaw);
  cover.hidden = true;
  progress.hidden = true;

  const input = steer(canvas, walker);
  const fit = () => {
    const { clientWidth: width, clientHeight: height } = canvas.parentElement;
    renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    renderer.setSize(width, height, false);
    camera.aspect = width / height;
    camera.fov = camera.aspect > 1 ? 65 : 85;
    camera.updateProjectionMatrix();
  };
  new ResizeObserver(fit).observe(canvas.parentElement);
  fit();
  let last = performance.now();
  const frame = (now) => {
    const seconds = Math.min((now - last) / 1000, 0.1);
    last = now;
    const { wish, jump, turn } = input();
    walker.yaw += turn * seconds * 2;
    for (let i = 0; i < 4; i++) walker.step(seconds / 4, wish, jump);
    walker.look(camera);
    renderer.render(gltf.scene, camera);
  };
  // Nothing is drawn while the walk is out of sight.
  new IntersectionObserver((seen) => renderer.setAnimationLoop(seen.at(-1).isIntersecting ? frame : null)).observe(canvas);
  canvas.focus({ preventScroll: true });
  return { renderer, camera, walker, scene: gltf.scene };
}
