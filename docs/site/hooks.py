"""What the generator's templates lack."""


def on_post_page(output, page, config):
    """A dialogue has a name, which a reader of screens says."""
    return output.replace('data-md-component="search" role="dialog"', 'data-md-component="search" role="dialog" aria-label="Search"')
