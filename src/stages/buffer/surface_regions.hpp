#pragma once

#include "domain/domain.hpp"
#include "stages/buffer/sheet_mesh.hpp"

namespace hexopt {

/// Regions of the surface: quads joined over every edge that is no ridge, whatever their patches. Where all
/// curves are captured these are the patches' connected parts.
struct SurfaceRegions {
    struct Border {
        Index a, b; ///< a <= b; equal where a curve ends inside a region
        Index curve;
        auto operator<=>(const Border&) const = default;
    };
    Index count = 0;
    std::vector<Border> borders; ///< sorted, once each
};

/// Numbers the regions by their first quad and writes them into mesh.surface.
SurfaceRegions find_regions(SheetMesh& mesh);

/// Borders between the regions that are written in mesh.surface.
std::vector<SurfaceRegions::Border> find_borders(const SheetMesh& mesh);

/// Parts regions further for sheets that may leave through smooth surface: on either side of ridges that have
/// the same region on both (a feature that fades out), where bands `rings` quads wide become regions of their
/// own. Where a part would come more than once in the order of quads round
/// a vertex, the quads there become one part's. Some of the numbers may have no quad then.
void cut_at_loose_ridges(SheetMesh& mesh, SurfaceRegions& regions, int rings);

/// Quads with a side on a ridge whose largest angle reaches `angle_deg`; some twice.
std::vector<Index> find_quads_at_ridges(const SheetMesh& mesh, const Domain& domain, double angle_deg);

/// Leaves of each region what is at most `rings` quads from its seeds; the rest gets another
/// number (that of its region + the count of regions before), until widen_regions() takes it back.
void narrow_regions(SheetMesh& mesh, SurfaceRegions& regions, std::span<const Index> seeds, int rings);
void widen_regions(SheetMesh& mesh, SurfaceRegions& regions);

/// Sets of regions, as numbers 0..count-1 by their lowest region.
class RegionGroups {
  public:
    explicit RegionGroups(Index region_count);
    bool join(Index a, Index b); ///< false: they were one already
    Index find(Index region) const;
    Index size() const { return static_cast<Index>(parent_.size()); } ///< regions
    void part(std::span<const Index> whole_groups); ///< all regions of some groups: each is one again
    /// Per region its group's number; the groups are numbered by their lowest region.
    std::vector<Index> numbers() const;

  private:
    mutable std::vector<Index> parent_;
};

/// Makes single regions of groups that have more than one fan of quads at some vertex: a sheet under all of
/// such a group would touch itself there.
void part_pinched(const SheetMesh& mesh, RegionGroups& groups);

/// Groups of buffer 1: joined over ridges whose angle reaches `join_deg` anywhere, at vertices with more than
/// three ridge edges, and at vertices where a group would touch itself. Source: fitting-notes 4.
RegionGroups group_for_split(const SheetMesh& mesh, const SurfaceRegions& regions, const Domain& domain,
                             double join_deg);

} // namespace hexopt
