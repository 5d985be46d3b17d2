// The materials of the built-in sample. They use common directives only, so that they serve as examples of the
// language.

// Opaque walls: light from the map, multiplied by an image.
sample/stone
{
	{
		map $lightmap
	}
	{
		map sample/stone_image.tga
		blendFunc filter
	}
}

// Polished floor: the image of the surroundings lies under the lightmap, so the floor mirrors a little.
sample/floor
{
	{
		map sample/floor_image.tga
	}
	{
		map sample/sheen.tga
		tcGen environment
		blendFunc add
	}
	{
		map $lightmap
		blendFunc filter
	}
}

// A cut-out: holes where alpha is below one half.
sample/grate
{
	surfaceparm trans
	cull none
	{
		map sample/grate_image.tga
		alphaFunc GE128
		depthWrite
		rgbGen identity
	}
	{
		map $lightmap
		blendFunc filter
		depthFunc equal
	}
}

// Lamps. The map compiler reads q3map_surfacelight; the waves change the light slowly.
sample/lamp_warm
{
	surfaceparm nolightmap
	q3map_lightRGB 1 0.62 0.28
	q3map_surfacelight 7000
	{
		map sample/lamp_warm.tga
		rgbGen wave sin 0.86 0.14 0 0.3
	}
}
sample/lamp_teal
{
	surfaceparm nolightmap
	q3map_lightRGB 0.12 0.85 1
	q3map_surfacelight 2000
	{
		map sample/lamp_teal.tga
		rgbGen wave sin 0.8 0.2 0.5 0.12
	}
}
sample/lamp_rose
{
	surfaceparm nolightmap
	q3map_lightRGB 1 0.45 0.3
	q3map_surfacelight 700
	{
		map sample/lamp_rose.tga
	}
}

// Stained glass: the image multiplies what lies behind, and the surroundings are mirrored.
sample/glass_amber
{
	surfaceparm trans
	surfaceparm nolightmap
	{
		map sample/glass_amber.tga
		blendFunc filter
	}
	{
		map sample/gleam.tga
		tcGen environment
		blendFunc add
	}
}
sample/glass_ruby
{
	surfaceparm trans
	surfaceparm nolightmap
	{
		map sample/glass_ruby.tga
		blendFunc filter
	}
	{
		map sample/gleam.tga
		tcGen environment
		blendFunc add
	}
}
sample/glass_azure
{
	surfaceparm trans
	surfaceparm nolightmap
	{
		map sample/glass_azure.tga
		blendFunc filter
	}
	{
		map sample/gleam.tga
		tcGen environment
		blendFunc add
	}
}

// Liquids: seen through, with waves where the image moves.
sample/water
{
	surfaceparm trans
	surfaceparm nonsolid
	surfaceparm water
	surfaceparm nolightmap
	cull none
	{
		map sample/water_image.tga
		blendFunc blend
		tcMod scale 0.5 0.5
		tcMod turb 0 0.05 0 0.12
		tcMod scroll 0.01 0.015
	}
}
// A solid ball that refracts as a liquid does: its image is still, so it has no waves.
sample/crystal
{
	surfaceparm trans
	surfaceparm nonsolid
	surfaceparm water
	surfaceparm nolightmap
	{
		map sample/crystal_image.tga
		blendFunc blend
	}
	{
		map sample/gleam.tga
		tcGen environment
		blendFunc add
	}
}

// A mirror: the entity misc_portal_surface stands before it.
sample/mirror
{
	surfaceparm nolightmap
	portal
	{
		map sample/mirror_image.tga
		blendFunc blend
		depthWrite
	}
}

// A volume of fog.
sample/mist
{
	surfaceparm trans
	surfaceparm nonsolid
	surfaceparm fog
	surfaceparm nolightmap
	fogParms ( 0.62 0.52 0.55 ) 200
}

// Evening sky: a low sun of some width, whose shadows are soft, and clouds that drift.
sample/sky
{
	surfaceparm sky
	surfaceparm noimpact
	surfaceparm nolightmap
	q3map_sunExt 1 0.8 0.55 340 -65 36 0.7 8
	q3map_skylight 60 3
	skyParms - 384 -
	{
		map sample/clouds.tga
		tcMod scale 2 2
		tcMod scroll 0.006 0.01
	}
}
