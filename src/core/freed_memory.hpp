#pragma once

namespace hexopt {

/// Gives memory that has been freed, but that the C library keeps, back to the system: between stages that
/// need much of it in different pieces. Some milliseconds for a hundred megabytes.
void give_back_freed_memory();

} // namespace hexopt
