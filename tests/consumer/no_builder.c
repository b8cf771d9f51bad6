#include <tandem/tandem.h>

/* A library that was made without oneTBB says so. */
int main(void) {
  tandem_asset* asset = NULL;
  return tandem_asset_build(NULL, NULL, NULL, &asset, NULL) != TANDEM_NO_BUILDER;
}
