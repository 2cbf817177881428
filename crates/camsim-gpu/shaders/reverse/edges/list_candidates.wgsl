// Lists the pixels that may see a silhouette, by the dilated tiles alone, for the later passes.
#import reverse/edges/pixel_list.wgsl
#import reverse/edges/near_silhouette.wgsl

fn list_for_rays(pixel: vec2<u32>, ray: Ray, gathered: Gathered) {
    // Above 1 where an edge pixel lies under a negative lobe of the spline.
    let touched_edge = abs(gathered.color.a - 1.0) > 1e-4;
    var may_see_silhouette = HAS_PARALLAX
        && ((dilated_tile(gathered.far_px[0]) | dilated_tile(gathered.far_px[1])) & 1u) != 0u;
    if (EMITS_RAYS) {
        may_see_silhouette = may_see_silhouette || is_near_silhouette(ray.uv, mid_pose(pixel));
    }
    if (touched_edge || may_see_silhouette) {
        add_to_list(pixel, touched_edge);
    }
}
