//! The paper's three methods: what they do to an image that has been drawn with Gouraud shading.
//!
//! They know no budget. All potentially highlighted triangles (PHTs) are found and treated in one go, right after the first image: subdivided
//! [regularly](crate::refine::paper::regular) with their neighbours, [at their highlights](crate::refine::paper::highlight), or shaded per
//! pixel. The parts are painted over their triangles.

use super::Method;
use super::base::BaseImage;
use super::refinement::{Leaf, LeafKind};
use super::stats::FrameStats;
use crate::backend::{Backend, Fill, Patch};
use crate::geometry::bary::{Bary, blend};
use crate::geometry::{Quadratic, Vec3s};
use crate::highlight::{self, SignBits};
use crate::illumination::{ActiveLights, ShadingKit, shade_points};
use crate::parallel::Exec;
use crate::refine::paper::centre::Subject;
use crate::refine::paper::highlight::HighlightSubdivision;
use crate::refine::paper::{PaperPart, PaperRule, regular};
use crate::scene::{View, World};

/// Triangles that are tested at a time.
const AT_ONCE: usize = 512;

/// Parts that there is room for from the start.
const ROOM: usize = 1 << 16;

/// Most points of a triangle that are illuminated at a time.
const MOST_POINTS: usize = 1 << 14;

/// A visible triangle that is treated.
#[derive(Clone, Copy, Debug)]
struct Treated {
    triangle: u32,
    is_pht: bool,
    /// How often it is split in four.
    levels: u32,
    /// How many patches it has.
    patches: u32,
}

/// What a method of the paper has made of the current image.
#[derive(Debug, Default)]
pub(super) struct Baseline {
    signs: SignBits,
    /// Corners of the triangles being tested.
    vertices: Vec<u32>,
    /// Ascending.
    treated: Vec<Treated>,
    /// By position of the world: whether a triangle that is treated has a corner there.
    is_marked: Vec<bool>,
    points: Points,
    colours: Vec<[f32; 3]>,
    subdivision: HighlightSubdivision,
    patches: Vec<Patch>,
    counts: Counts,
}

#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    phts: u64,
    matte: u64,
    subdivided: u64,
    parts: u64,
    phong_pixels: u64,
}

/// What drawing takes.
pub(super) struct Canvas<'a> {
    pub(super) exec: Exec,
    pub(super) world: &'a World,
    pub(super) view: &'a View,
    pub(super) base: &'a BaseImage,
    pub(super) backend: &'a mut dyn Backend,
}

impl Baseline {
    /// Finds what is to be treated: PHTs, and as many rings of neighbours as the method wants.
    pub(super) fn classify(&mut self, method: Method, rule: &PaperRule, canvas: &Canvas<'_>) {
        self.counts = Counts::default();
        self.treated.clear();
        self.patches.clear();
        self.treated.reserve(ROOM / 16);
        self.vertices.clear();
        self.vertices.reserve(3 * AT_ONCE);
        let lights = canvas.world.lights.len();
        self.signs.reserve(3 * AT_ONCE, lights);
        let world = canvas.world;
        for triangles in canvas.backend.visible_triangles().chunks(AT_ONCE) {
            self.vertices.clear();
            let corners = triangles.iter().map(|&t| world.triangles[t as usize]);
            self.vertices.extend(corners.flatten());
            let (level, eye) = (canvas.exec.level, canvas.view.eye);
            highlight::compute_signs(level, world, eye, &self.vertices, &mut self.signs);
            for (index, &triangle) in triangles.iter().enumerate() {
                let material = usize::from(world.triangle_material[triangle as usize]);
                if !world.materials[material].is_specular() {
                    self.counts.matte += 1;
                } else if self.signs.is_pht([3 * index, 3 * index + 1, 3 * index + 2]) {
                    self.treated.push(Treated {
                        triangle,
                        is_pht: true,
                        levels: 0,
                        patches: 0,
                    });
                }
            }
        }
        self.counts.phts = self.treated.len() as u64;
        if method == Method::Regular {
            for _ in 0..rule.rings {
                if !self.add_ring(canvas) {
                    break;
                }
            }
        }
    }

    /// Adds the visible triangles that share a vertex with one that is treated. False if there are none.
    fn add_ring(&mut self, canvas: &Canvas<'_>) -> bool {
        let world = canvas.world;
        let positions = &world.topology.position_of_vertex;
        let corners = |triangle: u32| {
            world.triangles[triangle as usize].map(|v| positions[v as usize] as usize)
        };
        self.is_marked.clear();
        self.is_marked.resize(positions.len(), false);
        for treated in &self.treated {
            for position in corners(treated.triangle) {
                self.is_marked[position] = true;
            }
        }
        let before = self.treated.len();
        let mut known = 0;
        for &triangle in canvas.backend.visible_triangles() {
            if known < before && self.treated[known].triangle == triangle {
                known += 1;
            } else if corners(triangle)
                .iter()
                .any(|&position| self.is_marked[position])
            {
                self.treated.push(Treated {
                    triangle,
                    is_pht: false,
                    levels: 0,
                    patches: 0,
                });
            }
        }
        self.treated
            .sort_unstable_by_key(|treated| treated.triangle);
        self.treated.len() > before
    }

    /// Treats them and paints what comes out.
    pub(super) fn draw(&mut self, method: Method, rule: &PaperRule, canvas: &mut Canvas<'_>) {
        self.patches.reserve(ROOM);
        self.points.reserve(MOST_POINTS);
        self.colours.clear();
        self.colours.reserve(MOST_POINTS);
        match method {
            Method::Regular => self.split_in_four(rule, canvas),
            Method::Highlight => self.divide_at_highlights(rule, canvas),
            _ => self.shade(canvas),
        }
        let geometry = canvas.base.geometry(canvas.world, canvas.view);
        canvas
            .backend
            .repaint(canvas.exec, geometry, &mut self.patches);
        for patch in &self.patches {
            if matches!(patch.fill, Fill::Phong { .. }) {
                self.counts.phong_pixels += u64::from(patch.pixels);
            }
        }
    }

    /// Has the pixels of PHTs shaded.
    fn shade(&mut self, canvas: &Canvas<'_>) {
        for treated in &mut self.treated {
            treated.patches = 1;
            self.patches.push(Patch {
                triangle: treated.triangle,
                corners: Bary::ROOT,
                fill: Fill::Phong {
                    lights: ActiveLights::all(canvas.world.lights.len()),
                    remainder: Quadratic::default(),
                },
                pixels: 0,
            });
        }
    }

    fn split_in_four(&mut self, rule: &PaperRule, canvas: &Canvas<'_>) {
        let Canvas {
            exec, world, view, ..
        } = *canvas;
        for treated in &mut self.treated {
            let corners = world.triangles[treated.triangle as usize].map(|v| v as usize);
            let positions = corners.map(|v| world.positions.get(v));
            let normals = corners.map(|v| world.normals.get(v));
            let pixels = canvas.backend.visible_pixels(treated.triangle);
            let area = area_px(view, positions).unwrap_or(pixels as f32);
            treated.levels = regular::levels(area, rule.area_px);
            if treated.levels == 0 {
                continue;
            }
            let material = usize::from(world.triangle_material[treated.triangle as usize]);
            let kit = ShadingKit::new(view.eye, &world.materials[material], &world.lights);
            let (points, colours) = (&mut self.points, &mut self.colours);
            colours.clear();
            let vertices = regular::vertices(treated.levels);
            points.illuminate(exec, &kit, positions, normals, vertices, colours);
            let before = self.patches.len();
            let parts = regular::parts(treated.triangle, treated.levels, |index| colours[index]);
            self.patches.extend(parts.map(patch_of));
            treated.patches = (self.patches.len() - before) as u32;
            self.counts.subdivided += 1;
            self.counts.parts += u64::from(treated.patches);
        }
    }

    fn divide_at_highlights(&mut self, rule: &PaperRule, canvas: &Canvas<'_>) {
        let Canvas {
            exec, world, view, ..
        } = *canvas;
        self.subdivision.reserve();
        for treated in &mut self.treated {
            let vertices = world.triangles[treated.triangle as usize];
            highlight::compute_signs(exec.level, world, view.eye, &vertices, &mut self.signs);
            let lights = self.signs.pht_lights([0, 1, 2]);
            let corners = vertices.map(|v| v as usize);
            let positions = corners.map(|v| world.positions.get(v));
            let normals = corners.map(|v| world.normals.get(v));
            let material = usize::from(world.triangle_material[treated.triangle as usize]);
            let kit = ShadingKit::new(view.eye, &world.materials[material], &world.lights);
            let centres = lights.iter().filter_map(|light| {
                let light = world.lights.get(light)?;
                Subject::new(positions, normals, light, &view.eye).centre(rule.accuracy)
            });
            let points = &mut self.points;
            let mut shade = |at: &[Bary], colours: &mut Vec<[f32; 3]>| {
                let at = at.iter().copied();
                points.illuminate(exec, &kit, positions, normals, at, colours);
            };
            let base = corners.map(|v| canvas.base.colours().get(v));
            let patches = &mut self.patches;
            let before = patches.len();
            self.subdivision.divide(
                treated.triangle,
                base,
                centres,
                rule.difference,
                &mut shade,
                |part| patches.push(patch_of(part)),
            );
            if patches.len() - before == 1 {
                // It is drawn already.
                patches.truncate(before);
            }
            treated.patches = (patches.len() - before) as u32;
            self.counts.subdivided += u64::from(treated.patches > 0);
            self.counts.parts += u64::from(treated.patches);
        }
    }

    /// Fills in what has been done.
    pub(super) fn report(&self, stats: &mut FrameStats) {
        stats.pht = self.counts.phts;
        stats.pht_visible = self.counts.phts;
        stats.refined = self
            .treated
            .iter()
            .filter(|t| t.is_pht && t.patches > 0)
            .count() as u64;
        stats.triangles_subdivided = self.counts.subdivided;
        stats.leaves = self.counts.parts;
        stats.phong_pixels = self.counts.phong_pixels;
        stats.skipped.triangles_matte = self.counts.matte;
    }

    /// Calls `f` with every visible triangle, or its parts.
    pub(super) fn for_each_leaf(
        &self,
        world: &World,
        base: &BaseImage,
        backend: &dyn Backend,
        mut f: impl FnMut(&Leaf),
    ) {
        let mut treated = self.treated.iter().peekable();
        let mut patches = self.patches.iter();
        for &triangle in backend.visible_triangles() {
            let own = treated.next_if(|treated| treated.triangle == triangle);
            let colours = corner_colours(world, base.colours(), triangle);
            let whole = Leaf {
                is_pht: own.is_some_and(|treated| treated.is_pht),
                ..Leaf::root(triangle, colours, backend.visible_pixels(triangle))
            };
            let parts = own.map_or(0, |treated| treated.patches as usize);
            if parts == 0 {
                f(&whole);
            }
            for patch in patches.by_ref().take(parts) {
                let (kind, colours) = match patch.fill {
                    Fill::Gouraud(colours) => (LeafKind::Interpolated, colours),
                    Fill::Phong { .. } => (LeafKind::PerPixel, colours),
                };
                f(&Leaf {
                    corners: patch.corners,
                    colours,
                    pixels: patch.pixels,
                    kind,
                    level: own.map_or(0, |treated| treated.levels.max(u32::from(parts > 1))),
                    ..whole
                });
            }
        }
    }
}

fn patch_of(part: PaperPart) -> Patch {
    Patch {
        triangle: part.triangle,
        corners: part.corners,
        fill: Fill::Gouraud(part.colours),
        pixels: 0,
    }
}

fn corner_colours(world: &World, colours: &Vec3s, triangle: u32) -> [[f32; 3]; 3] {
    world.triangles[triangle as usize].map(|v| colours.get(v as usize))
}

/// Area of a triangle on the screen in pixels, visible or not; `None` if it reaches behind the eye.
fn area_px(view: &View, corners: [[f32; 3]; 3]) -> Option<f32> {
    let projected = corners.map(|p| view.project(p));
    if !projected.iter().all(|p| p[3] > 0.0) {
        return None;
    }
    let [a, b, c] = projected.map(|[x, y, _, w]| glam::DVec2::new(x / w, y / w));
    Some(((b - a).perp_dot(c - a).abs() * 0.5) as f32)
}

/// Points of a triangle being illuminated.
#[derive(Debug, Default)]
struct Points {
    points: Vec3s,
    normals: Vec3s,
    colours: Vec3s,
}

impl Points {
    /// Makes room for so many points.
    fn reserve(&mut self, points: usize) {
        for list in [&mut self.points, &mut self.normals, &mut self.colours] {
            list.clear();
            list.reserve(points);
        }
    }

    /// Appends the colours at points of a triangle with these corners and normals.
    fn illuminate(
        &mut self,
        exec: Exec,
        kit: &ShadingKit<'_>,
        positions: [[f32; 3]; 3],
        normals: [[f32; 3]; 3],
        at: impl Iterator<Item = Bary>,
        colours: &mut Vec<[f32; 3]>,
    ) {
        self.points.clear();
        self.normals.clear();
        for point in at {
            let weights = point.weights();
            self.points.push(blend(weights, positions));
            self.normals.push(blend(weights, normals));
        }
        let count = self.points.len();
        self.colours.resize(count);
        let active = ActiveLights::all(kit.lights.len());
        shade_points(
            exec.level,
            kit,
            &active,
            0..count,
            &self.points,
            &self.normals,
            &mut self.colours,
        );
        colours.extend((0..count).map(|index| self.colours.get(index)));
    }
}
