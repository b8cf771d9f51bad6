"""What the generator's templates lack."""
import re


def on_post_page(output, page, config):
    """A dialogue has a name, which a reader of screens says. The name of an option stays in one line."""
    output = re.sub(r"<code>(?=-[^<]{1,32}</code>)", '<code class="option-name">', output)
    return output.replace('data-md-component="search" role="dialog"', 'data-md-component="search" role="dialog" aria-label="Search"')
