//! What a view consists of, in numbers: what the scene holds, what of it is visible, what was skipped and what was refined.
//!
//! Counts describe the image after the frame inspected, not the work of that frame.

use crate::frame::{Engine, FrameStats, Leaf, LeafKind};
use crate::highlight::{self, Verdict};
use crate::scene::{Scene, View, World};
use serde::Serialize;

/// Numbers about a view.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Inspection {
    /// Objects of the scene.
    pub objects: usize,
    /// Vertices of all objects; where normals, materials or sides differ a position has several.
    pub vertices: usize,
    /// Triangles of all objects; backs that are drawn count, too.
    pub triangles: TriangleCounts,
    /// Runs of neighbouring triangles that are culled as a whole.
    pub clusters: ClusterCounts,
    /// Pixels that some triangle owns.
    pub covered_pixels: u64,
    /// Lights of the scene.
    pub lights: LightCounts,
    /// Materials of the scene, in its order.
    pub materials: Vec<MaterialCounts>,
    /// Potentially highlighted triangles.
    pub pht: PhtCounts,
    /// What is known of the highlights of visible triangles.
    pub verdicts: VerdictCounts,
    /// How far refinement has come.
    pub refinement: RefinementCounts,
}

/// What has become of the scene's triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct TriangleCounts {
    /// All of them.
    pub total: u64,
    /// Those in clusters that were culled.
    pub in_culled_clusters: u64,
    /// Those of the others that face away.
    pub facing_away: u64,
    /// Those of the others outside of the view or between pixels.
    pub off_screen: u64,
    /// The rest: sent to the rasterizer's tiles.
    pub drawn: u64,
    /// Those drawn that own no pixel.
    pub hidden: u64,
    /// Those that do.
    pub visible: u64,
}

/// What has become of clusters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ClusterCounts {
    /// All of them.
    pub total: u64,
    /// Outside of the view.
    pub off_screen: u64,
    /// Facing away.
    pub facing_away: u64,
    /// The rest.
    pub visible: u64,
}

/// Lights by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct LightCounts {
    /// All of them.
    pub total: u64,
    /// At a point.
    pub point: u64,
    /// Infinitely far away, or so far that it makes no difference.
    pub directional: u64,
}

/// What is made of a material.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MaterialCounts {
    /// Whether it has a specular term.
    pub is_specular: bool,
    /// Specular exponent.
    pub shininess: f32,
    /// Backs are drawn, too.
    pub two_sided: bool,
    /// Triangles made of it, fronts and backs.
    pub triangles: u64,
    /// Those of them that own a pixel.
    pub visible_triangles: u64,
}

/// Potentially highlighted triangles: those that pass the paper's test for some light. Zero with methods that draw one
/// image and are done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct PhtCounts {
    /// All that were tested: only those that own a pixel are.
    pub total: u64,
    /// The same.
    pub visible: u64,
    /// Those of the visible ones that have been subdivided or shaded per pixel.
    pub refined: u64,
    /// Pixels of the visible ones.
    pub pixels: u64,
}

/// Visible triangles by what their bounds and the paper's test say. See [`Verdict`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct VerdictCounts {
    /// Proved right when interpolated.
    pub absent: u64,
    /// Not proved, and not a PHT.
    pub lobe: u64,
    /// Not proved, and a PHT.
    pub centre: u64,
}

/// How far refinement has come.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct RefinementCounts {
    /// Triangles subdivided.
    pub triangles_subdivided: u64,
    /// Leaves of subdivided triangles by level: how often the triangle was quartered to get one of that size. Level 0
    /// is whole triangles. Leaves without a pixel are counted too.
    pub leaves_by_level: Vec<u64>,
    /// Leaves that are planned, but that the budget did not suffice to paint.
    pub leaves_not_painted: u64,
    /// Triangles and leaves shaded per pixel.
    pub per_pixel_leaves: u64,
    /// Pixels shaded by the illumination equation; all covered ones with [`Method::Phong`](crate::Method::Phong).
    pub per_pixel_pixels: u64,
    /// Triangles that were looked at and proved right as they were.
    pub triangles_proved: u64,
    /// Light terms (diffuse or specular, of one light on one triangle) proved not to need evaluation.
    pub light_terms_skipped: u64,
}

impl Inspection {
    /// Looks at the image that `engine` has just rendered of `scene`, at this size.
    #[must_use]
    pub fn new(engine: &Engine, scene: &Scene, stats: &FrameStats, size: [u32; 2]) -> Self {
        let world = engine.world();
        let view = world
            .view(scene.camera(), size[0], size[1])
            .with_encoding(engine.encoding());
        let mut leaves = LeafCounts::new(world, scene);
        engine.for_each_leaf(|leaf| leaves.add(world, &view, leaf));
        Self {
            objects: scene.objects().len(),
            vertices: world.positions.len(),
            triangles: triangles(stats),
            clusters: clusters(world, stats),
            covered_pixels: stats.covered_pixels,
            lights: lights(world),
            materials: leaves.materials,
            pht: PhtCounts {
                total: stats.pht,
                visible: stats.pht_visible,
                refined: stats.refined,
                pixels: leaves.pht_pixels,
            },
            verdicts: leaves.verdicts,
            refinement: RefinementCounts {
                triangles_subdivided: stats.triangles_subdivided,
                triangles_proved: stats.skipped.triangles_proved,
                light_terms_skipped: stats.skipped.light_terms,
                per_pixel_pixels: stats.phong_pixels.max(leaves.whole_per_pixel_pixels),
                ..leaves.refinement
            },
        }
    }
}

fn triangles(stats: &FrameStats) -> TriangleCounts {
    let skipped = &stats.skipped;
    let submitted =
        stats.triangles_drawn + skipped.triangles_facing_away + skipped.triangles_off_screen;
    TriangleCounts {
        total: stats.triangles,
        in_culled_clusters: stats.triangles.saturating_sub(submitted),
        facing_away: skipped.triangles_facing_away,
        off_screen: skipped.triangles_off_screen,
        drawn: stats.triangles_drawn,
        hidden: skipped.triangles_hidden,
        visible: stats.triangles_visible,
    }
}

fn clusters(world: &World, stats: &FrameStats) -> ClusterCounts {
    let (total, skipped) = (world.clusters.len() as u64, &stats.skipped);
    let culled = skipped.clusters_off_screen + skipped.clusters_facing_away;
    ClusterCounts {
        total,
        off_screen: skipped.clusters_off_screen,
        facing_away: skipped.clusters_facing_away,
        visible: total.saturating_sub(culled),
    }
}

fn lights(world: &World) -> LightCounts {
    let total = world.lights.len() as u64;
    let point = world.lights.iter().filter(|light| light.is_point).count() as u64;
    LightCounts {
        total,
        point,
        directional: total - point,
    }
}

/// What is counted leaf by leaf.
struct LeafCounts {
    /// Triangles met so far.
    seen: Vec<bool>,
    materials: Vec<MaterialCounts>,
    pht_pixels: u64,
    verdicts: VerdictCounts,
    refinement: RefinementCounts,
    whole_per_pixel_pixels: u64,
}

impl LeafCounts {
    fn new(world: &World, scene: &Scene) -> Self {
        let two_sided = |index: usize| scene.materials().get(index).is_some_and(|m| m.two_sided);
        let mut materials: Vec<MaterialCounts> = world
            .materials
            .iter()
            .enumerate()
            .map(|(index, material)| MaterialCounts {
                is_specular: material.is_specular(),
                shininess: material.shininess,
                two_sided: two_sided(index),
                triangles: 0,
                visible_triangles: 0,
            })
            .collect();
        for &material in &world.triangle_material {
            materials[usize::from(material)].triangles += 1;
        }
        Self {
            seen: vec![false; world.triangles.len()],
            materials,
            pht_pixels: 0,
            verdicts: VerdictCounts::default(),
            refinement: RefinementCounts::default(),
            whole_per_pixel_pixels: 0,
        }
    }

    fn add(&mut self, world: &World, view: &View, leaf: &Leaf) {
        let pixels = u64::from(leaf.pixels);
        if !std::mem::replace(&mut self.seen[leaf.triangle as usize], true) {
            self.add_triangle(world, view, leaf);
        }
        if leaf.is_pht {
            self.pht_pixels += pixels;
        }
        let refinement = &mut self.refinement;
        if !leaf.is_painted {
            refinement.leaves_not_painted += 1;
            return;
        }
        if leaf.kind == LeafKind::PerPixel {
            refinement.per_pixel_leaves += 1;
            if leaf.level == 0 {
                self.whole_per_pixel_pixels += pixels;
            }
        }
        let level = leaf.level as usize;
        if refinement.leaves_by_level.len() <= level {
            refinement.leaves_by_level.resize(level + 1, 0);
        }
        refinement.leaves_by_level[level] += 1;
    }

    /// Counts a visible triangle, given one of its leaves.
    fn add_triangle(&mut self, world: &World, view: &View, leaf: &Leaf) {
        let material = usize::from(world.triangle_material[leaf.triangle as usize]);
        self.materials[material].visible_triangles += 1;
        let verdict =
            highlight::light_masks(world, &view.eye, view.encoding, leaf.triangle).verdict;
        match (verdict, leaf.is_pht) {
            (Verdict::Absent, _) => self.verdicts.absent += 1,
            (_, false) => self.verdicts.lobe += 1,
            (_, true) => self.verdicts.centre += 1,
        }
    }
}
