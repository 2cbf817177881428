// Pixels that may see a silhouette, as far as a look at what is within reach tells, are listed for the passes
// after this one.
#import reverse/edges/list.wgsl
#import reverse/edges/near.wgsl

fn list_for_rays(pixel: vec2<u32>, ray: Ray, plain: Gathered) {
    // Above 1 where a mark lies under a negative weight of the spline.
    let marked = abs(plain.color.a - 1.0) > 1e-4;
    var within_reach = HAS_PARALLAX && ((reach_of(plain.far_px[0]) | reach_of(plain.far_px[1])) & 1u) != 0u;
    if (EMITS_RAYS) {
        within_reach = within_reach || near_edge(ray.uv, pose_of_mid(pixel));
    }
    if (marked || within_reach) {
        add_to_list(pixel, marked);
    }
}
