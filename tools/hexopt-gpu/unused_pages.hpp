#pragma once

namespace hexopt::cli {

/// Gives back the memory of code and tables that starting the program has touched and a run hardly ever uses
/// again: mostly the symbols of CAD libraries, of which the loader reads half. They are read anew from the
/// files where they are needed after all.
void release_loaded_pages();

} // namespace hexopt::cli
