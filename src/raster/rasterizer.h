#pragma once

#include <array>
#include <functional>
#include <memory>

#include "raster/pixels.h"
#include "raster/workspace.h"
#include "vk/batch.h"

namespace splat::raster {

/// What the latest forward call did.
struct RasterStats {
    std::uint64_t visible = 0;      ///< (Gaussian, view) sorted, in the pass with most: those that
                                    ///< reach a tile or, without skips.cull, those not culled
    std::uint64_t non_finite = 0;   ///< (Gaussian, view) refused: a value is not finite
    std::uint64_t culled = 0;       ///< all other (Gaussian, view)
    std::uint64_t pairs = 0;        ///< (tile, Gaussian, view)
    std::uint64_t longest = 0;      ///< longest list of a tile
    std::uint64_t empty_tiles = 0;  ///< empty tiles of all views
    std::uint64_t tiles = 0;
    std::uint64_t bytes = 0;   ///< device memory of the workspace
    std::uint64_t banded = 0;  ///< Gaussians of the scene, if it was drawn in bands; else 0
    std::uint32_t passes = 1;  ///< groups of tile rows
    std::uint32_t runs =
        1;  ///< 0: nothing had changed; 2 or more: the pairs needed other arrays or passes
};

/// A frame that was given to the device.
struct RasterFrame {
    std::uint64_t value = 0;  ///< see vk::Queue::submit_frame
    std::uint64_t lost = 0;   ///< value of an earlier frame that was not drawn whole; 0: none
    bool waited = false;      ///< the host waited until it was drawn
};

/// Most items that the device takes at a time.
std::uint64_t most_items(const vk::DeviceInfo& device, const RasterDesc& desc);

/// Errors: kInvalidArgument; kUnsupported beyond the device's limits.
Status check_desc(const vk::DeviceInfo& device, const RasterDesc& desc);

/// Runs the stages of 3D Gaussian splatting and owns their memory. Forward: project, sort by depth,
/// tile_bin, sort by tile, tile_ranges, blend.
///
/// A call is one submit while all pairs fit. If they do not, the arrays grow and the call runs
/// again; where a binding is full, the image is drawn in groups of tile rows. Lists of tiles that
/// would keep a workgroup busy for long are walked in parts. The result is the same.
///
/// A call may have fewer Gaussians and views than desc(), and smaller views, with the bits of a
/// rasterizer made for exactly so many of that size (gradients of more tiles than max_window_tiles(),
/// which are added pass by pass, up to rounding). Command lists are recorded again when their
/// numbers change, and between calls with and without smaller views or a mask of tiles.
class Rasterizer {
  public:
    /// Errors: those of check_desc(), kOutOfDeviceMemory.
    static Result<std::unique_ptr<Rasterizer>> create(vk::Context& context, const RasterDesc& desc);

    /// Draw `scene`. `views` comes from pack_views and mask_tiles with this rasterizer's desc; both
    /// may be empty.
    ///
    /// Errors: kInvalidArgument for more Gaussians than desc(); kUnsupported for 2^24 or more
    /// Gaussians on one tile; those of create. If the call fails before the device starts,
    /// the results of the previous call stay valid.
    Status forward(const SetViews& scene, const PackedViews& views);

    /// Draw the only view of a call into a target of the application, and do not wait where the device has drawn such
    /// a call before and all pairs fit one pass. A frame of more pairs than memory, or of longer lists than a part, is
    /// lost: finish() finds out, and the next call waits. Errors: those of forward().
    Result<RasterFrame> submit(const SetViews& scene, const PackedViews& views, PixelFormat format,
                               vk::FrameTarget target);

    /// Wait for a frame that runs, so that results and stats are its. Errors: those of Queue::settle, and of growing.
    Status finish();

    /// Draw a scene of `gaussians`, more than desc() has, band by band of tile rows (raster/bands.h): `load`
    /// puts those of a band on the device. Pixels are as if all were drawn at once; what the workspace holds
    /// of each item is of the last band. Errors: as forward(), and those of `load`; then no results are valid.
    Status forward_in_bands(std::uint64_t gaussians, std::span<const Window> bands,
                            const std::function<Result<SetViews>(const Window& band)>& load,
                            const PackedViews& views);

    /// Compute the gradient of the latest forward call. The workspace keeps pose, intrinsics,
    /// exported gradients and contributions.
    ///
    /// grad_image   [V,H,W] quads of the call's V views: of RGB and alpha
    /// grad_depth   [V,H,W] float32, unread unless desc.grad_depth
    /// gradients    quads of bands above gradients.sh_degree are left as they are
    Status backward(const vk::BufferView& grad_image, const vk::BufferView& grad_depth,
                    const SetViews& gradients);

    /// True if the workspace holds the results of a forward call that succeeded.
    [[nodiscard]] bool drawn() const { return valid_; }

    /// True if recorded command lists may name these arrays. They name those of one scene.
    [[nodiscard]] bool names(const SetViews& scene) const;

    /// Call before the scene's arrays are written: the results no longer count as drawn.
    void invalidate() { valid_ = false; }

    /// What it was made for.
    [[nodiscard]] const RasterDesc& desc() const { return desc_; }
    /// The same with the numbers of Gaussians and views of the latest forward call.
    [[nodiscard]] const RasterDesc& drawn_desc() const { return now_; }
    [[nodiscard]] const RasterStats& stats() const { return stats_; }
    [[nodiscard]] const Workspace& workspace() const { return space_; }

  private:
    Rasterizer(vk::Context& context, const RasterDesc& desc)
        : context_(context), desc_(desc), now_(desc) {}
    /// `rows`: none for all.
    Status draw(const SetViews& scene, const PackedViews& views, const Window& rows);
    /// Record and upload what a call needs. False if nothing has changed since the last.
    Result<bool> prepare(const SetViews& scene, const PackedViews& views, const Window& rows);
    /// Draw what is prepared, with more memory or passes if it needs them.
    Status run_to_end();
    Status record_pixels(PixelFormat format);
    struct PassStats {
        std::uint64_t needed, longest;
    };
    /// Add a pass that has run to `sum`, and its pairs to `all`.
    Result<PassStats> read_pass(RasterStats& sum, std::uint64_t& all);
    void complete(RasterStats sum);
    Status allocate_first_pairs();
    Status count_items();
    Status upload(PackedViews views);
    Status record(const SetViews& scene, const RasterDesc& desc);
    Status record_forward(const SetViews& scene);
    Status record_forward_pass(vk::Recorder& recorder, const SetViews& scene, const Window& window);
    Status record_blend(vk::Recorder& recorder, const SetViews& scene, const Window& window);
    /// Blend a pass's lists of more than entries_, of up to `longest`.
    Status run_parts(std::uint32_t pass, std::uint32_t longest);
    Status record_backward(const vk::BufferView& grad_image, const vk::BufferView& grad_depth,
                           const SetViews& gradients);
    /// `needed` is the most pairs of a pass, `all` the pairs of all passes if each fits.
    Status run_forward(std::uint64_t& needed, std::uint64_t& all);
    Status grow(std::uint64_t needed);
    [[nodiscard]] std::uint32_t more_passes(std::uint32_t passes, std::uint64_t needed) const;
    [[nodiscard]] bool could_begin_so(std::uint64_t all) const;
    [[nodiscard]] TileRanges tile_views() const;
    [[nodiscard]] BlendViews blend_views(const Window& window) const;
    [[nodiscard]] CallViews call_views() const;

    vk::Context& context_;
    RasterDesc desc_;  ///< capacities
    RasterDesc now_;   ///< what the command lists were recorded for
    Workspace space_;
    RasterStats stats_;
    std::uint32_t passes_ = 1;
    SetViews scene_;
    PackedViews uploaded_;                  ///< what the device has
    bool valid_ = false;                    ///< the workspace holds a finished forward call
    std::uint32_t counted_ = 0;             ///< value of the workspace's item count
    std::vector<vk::CommandList> forward_;  ///< one per pass; empty = not recorded
    std::vector<vk::CommandList> backward_;
    struct Parts {
        vk::CommandList list;
        std::uint64_t longest = 0;  ///< list that it walks to the end
    };
    std::vector<Parts> parts_;   ///< each pass's of forward_, where lists are longer than entries_
    std::uint32_t entries_ = 0;  ///< length of a part in forward_
    std::uint32_t backward_entries_ = 0;  ///< length of a part in backward_
    std::uint64_t backward_longest_ = 0;  ///< list that backward_ walks to the end
    std::array<vk::BufferView, 4> backward_views_;
    std::uint32_t backward_degree_ = 0;
    bool known_ = false;        ///< stats_ are of a call of forward_'s lists
    std::uint64_t flying_ = 0;  ///< value of the frame that runs
    std::uint64_t lost_ = 0;    ///< value of a frame that the caller must hear of
    vk::Batch frames_{2};       ///< what submit() joins
    vk::Buffer pixels_;         ///< what is copied to the target
    vk::CommandList pixels_list_;
    PixelFormat pixel_format_ = PixelFormat::kBytes;
};

}  // namespace splat::raster
