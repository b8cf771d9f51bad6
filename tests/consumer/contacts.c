#include <stdio.h>
#include <tandem/tandem.h>

/* Two bodies half a length apart: how many of their triangles meet. */
int main(int argc, char** argv) {
  tandem_asset* asset = NULL;
  tandem_contact_query* query = NULL;
  const tandem_instance bodies[2] = {{0, 0, {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0.0, 0, 0}}},
                                     {0, 0, {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0.5, 0, 0}}}};
  tandem_status status = tandem_asset_open(argc > 1 ? argv[1] : "", NULL, NULL, &asset, NULL);
  if (status == TANDEM_OK) status = tandem_contact_query_create(NULL, &query);
  if (status == TANDEM_OK) status = tandem_contact_query_set_assets(query, &asset, 1);
  if (status == TANDEM_OK) status = tandem_contact_query_find_contacts(query, bodies, 2, NULL);
  if (status == TANDEM_OK) {
    size_t count;
    const tandem_contact* contacts = tandem_contact_query_contacts(query, &count);
    printf("%zu pairs of triangles meet, such as faces %u and %u\n", count, (unsigned)contacts[0].face_a,
           (unsigned)contacts[0].face_b);
  } else {
    printf("%s\n", tandem_status_explain(status));
  }
  tandem_contact_query_destroy(query);
  tandem_asset_release(asset);
  return status != TANDEM_OK;
}
