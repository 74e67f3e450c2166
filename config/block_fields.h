#pragma once

#include "base/block.h"
#include "config/fields.h"

namespace opaline::config {

/// The keys `size` and `cells` of a block.
void visit_block(Fields& fields, Block& block);

/// A face of the block by its name, "z_max".
void visit_face(Fields& fields, const Key& key, Face& face);

}  // namespace opaline::config
