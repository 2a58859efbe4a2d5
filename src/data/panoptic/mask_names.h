#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/status.h"
#include "io/image.h"

namespace splat::data {

/// The number of a colour: R + 256 G + 65536 B.
using MaskId = std::uint32_t;

/// Pixels of a mask that have one number.
struct Segment {
    MaskId id = 0;
    std::string name;                 ///< name of its class
    std::uint64_t area = 0;           ///< pixels
    std::uint32_t left = 0, top = 0;  ///< the box around it, pixels
    std::uint32_t width = 0, height = 0;
};

/// What the colours of masks mean: COCO's panoptic annotations, or a palette.
///
/// Source  cocodataset.org, "Data format", 4. Panoptic Segmentation; the palette is GIMP's format.
class MaskNames {
  public:
    /// A file that ends with .json has COCO's annotations; any other is a palette, with lines "R G B name". Errors: as
    /// io::read_file(); those of the two below, with the file.
    static Result<MaskNames> load(const std::string& path);

    /// {"images": [{"id", "width", "height"}], "annotations": [{"image_id", "file_name", "segments_info": [{"id",
    /// "category_id"}]}], "categories": [{"id", "name"}]}; other members are not used, areas and boxes are those of the
    /// pixels. Errors: kFormat, naming the place.
    static Result<MaskNames> of_coco(std::string_view text);

    /// Lines "R G B name". Leaves out the heading "GIMP Palette", the lines "Name:" and "Columns:", and comments, which
    /// begin with '#'. Colours of one name are instances of one class. Errors: kFormat, naming the line.
    static Result<MaskNames> of_palette(std::string_view text);

    /// The segments of a mask, the largest first, those of one area by their numbers; without 0 of COCO and the colours
    /// named "void". `file` is the mask's path in the folder of masks, with '/'. Errors: kFormat for a number that has
    /// no name, with its place; for a segment of the annotation that has no pixel; for another size than the
    /// annotation's; for a mask of COCO that is not RGB, and any with alpha.
    [[nodiscard]] Result<std::vector<Segment>> segments(const io::Image& mask,
                                                        const std::string& file) const;

  private:
    /// An annotation of COCO.
    struct Picture {
        std::uint32_t width = 0, height = 0;
        std::map<MaskId, std::string> names;  ///< class of each segment
    };

    [[nodiscard]] Result<const Picture*> picture(const std::string& file) const;
    [[nodiscard]] Result<std::string> name_of(const Picture* picture, MaskId id, std::uint32_t x,
                                              std::uint32_t y) const;

    bool coco_ = false;
    std::map<std::string, Picture, std::less<>> pictures_;  ///< by file_name
    std::map<MaskId, std::string> palette_;
};

}  // namespace splat::data
